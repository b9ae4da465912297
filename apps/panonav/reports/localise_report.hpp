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

/// A picture and what the memory says of it.
struct LocalisedQuery {
  std::string file;
  double turned_rad = 0.0;  ///< before it was asked about
  Place place;
  std::optional<ReferencePose> pose;  ///< as the data set gives it
  std::string error;                  ///< why it could not be read; empty: it could
};

/// A page with what was seen above the best match, turned alike, a map, and the figures by which a
/// person can judge the answer: of 200 of the queries, evenly spread, and a table of the first 500.
/// `panorama` gives that of a query by its number. Throws FileError.
void write_localise_report(const std::filesystem::path& folder, const MemoryFile& file,
                           const PlaceRecogniser& recogniser,
                           const std::vector<LocalisedQuery>& queries,
                           const std::function<Panorama(std::size_t)>& panorama);

}  // namespace panonav::command
