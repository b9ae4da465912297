#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

/// An image and the memory's answer to it.
struct LocalisedQuery {
  std::string file;
  double turned_rad = 0.0;  ///< rotation of the image before localisation
  Place place;
  std::optional<ReferencePose> pose;  ///< as the data set gives it
  std::string error;                  ///< why it could not be read; empty: it could
};

/// Writes a page that shows each query above its best match, rotated to the same heading, a map,
/// and the figures by which a person can judge the answer: for 200 evenly chosen queries, and a
/// table of the first 500. `panorama` returns that of a query by its number. Throws FileError.
void write_localise_report(const std::filesystem::path& folder, const MemoryFile& file,
                           const PlaceRecogniser& recogniser,
                           const std::vector<LocalisedQuery>& queries,
                           const std::function<Panorama(std::size_t)>& panorama);

}  // namespace panonav::command
