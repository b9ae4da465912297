#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/arguments.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/route/horizon_line.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

/// What a route says of its lines beyond their bytes: how pictures became lines, and where the
/// poses came from. Kept in the memory beside it.
struct RouteSource {
  HorizonLineOptions line;
  /// First and last row that show the horizon, counted from 0 at the top; for panoramas whose
  /// elevations are not known.
  std::optional<std::pair<int, int>> horizon_rows;
  bool from_odometry = false;  ///< poses are in the odometry's frame, not in the data set's
  friend bool operator==(const RouteSource&, const RouteSource&) = default;
};

/// Of the route `name`. Throws FileError when the memory says something else than
/// `remember_route_source` wrote.
[[nodiscard]] RouteSource route_source(const MemoryFile& memory, const std::string& name,
                                       int columns);
void remember_route_source(MemoryFile& memory, const std::string& name, const RouteSource& source);

/// From pictures to horizon lines. Several threads may use one.
class LineReader {
 public:
  /// Throws UsageError on horizon rows for pictures whose elevations are known.
  LineReader(const PictureSource& pictures, const RouteSource& route);
  /// Throws FileError on a picture that cannot be read or does not show the horizon.
  [[nodiscard]] std::vector<float> read(const std::filesystem::path& picture) const;
  /// The same of a picture that is not in a file. Throws ContractError.
  [[nodiscard]] std::vector<float> convert(ImageView picture) const {
    return line_of(reader_.convert(picture));
  }

 private:
  [[nodiscard]] std::vector<float> line_of(const Panorama& panorama) const;

  RouteSource route_;
  PanoramaReader reader_;
};

/// The route's name, the only route where none is named. Throws FileError when there is no such
/// route, or several and none is named.
[[nodiscard]] std::string route_named(const MemoryFile& memory,
                                      const std::optional<std::string>& name);

/// Poses of all entries in the data set's frame. Where it knows positions but no headings, those
/// along the way: the tangent fitted to the positions within 0.3 m of way to either side. Empty
/// where it knows no positions.
[[nodiscard]] std::vector<Pose2> dataset_poses(const Dataset& dataset);
/// Likewise by its odometry; empty where it has none.
[[nodiscard]] std::vector<Pose2> odometry_poses(const Dataset& dataset);

}  // namespace panonav::command
