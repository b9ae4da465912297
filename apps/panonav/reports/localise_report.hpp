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

/// An image and the place that was found for it.
struct LocalisedQuery {
  std::string file;
  double turned_rad = 0.0;  ///< rotation of the image before localisation
  Place place;
  std::optional<ReferencePose> pose;  ///< true pose from the data set
  std::string error;                  ///< why the image could not be read; empty: no error
};

/// Writes a page with a map and each query above its best match, rotated to the same heading. Shows
/// 200 queries at equal intervals and a table of the first 500. `panorama(i)` returns the
/// panorama of query i. Throws FileError.
void write_localise_report(const std::filesystem::path& folder, const MemoryFile& file,
                           const PlaceRecogniser& recogniser,
                           const std::vector<LocalisedQuery>& queries,
                           const std::function<Panorama(std::size_t)>& panorama);

}  // namespace panonav::command
