#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav/io/panorama_reader.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav/route/horizon_scanline.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Describes how the lines of a route were made from images, and where its poses come from. The
/// memory stores it with the route.
struct RouteSource {
  HorizonScanlineOptions line;  ///< columns and band of the lines
  /// First and last row that show the horizon, counted from 0 at the top; only for panoramas of
  /// unknown elevations.
  std::optional<std::pair<int, int>> horizon_rows;
  bool from_odometry = false;  ///< true: poses are in the odometry's frame, not the data set's
  /// Metres of a unit of the poses if things around are as far away as assumed; the poses were then
  /// computed from images alone and are in view steps. nullopt: poses are in metres.
  std::optional<double> assumed_unit_m = std::nullopt;
  /// Returns the metres of a unit of the poses, for limits that need no precision. A view step is
  /// taken as 2 cm at least, as in a video at a walking pace: lengths by images are far too small
  /// where views hardly differ.
  [[nodiscard]] double rough_unit_m() const noexcept {
    constexpr double min_view_step_m = 0.02;
    return assumed_unit_m ? std::max(min_view_step_m, *assumed_unit_m) : 1.0;
  }
  /// True: lengths are those of the memory's map, so scaling the map scales the route. False: they
  /// are metres of a data set or of odometry.
  bool is_in_map_unit = false;
  /// Scale of the map (`read_map_scale`) by which poses in the unit of the map are in metres.
  /// nullopt: unknown, or poses are in view steps or not in the unit of the map.
  std::optional<double> map_scale = std::nullopt;
  friend bool operator==(const RouteSource&, const RouteSource&) = default;
};

/// Reads the source of the route `name`. Throws FileError unless the stored text was written by
/// `store_route_source`.
[[nodiscard]] RouteSource read_route_source(const MemoryFile& memory, const std::string& name,
                                            int columns);
/// Stores the source in the memory, under the route's name. Throws FileError.
void store_route_source(MemoryFile& memory, const std::string& name, const RouteSource& source);

/// Makes horizon scanlines of observations in the same form as a route's lines. Several threads may
/// use one object concurrently.
class LineEncoder {
 public:
  /// Throws ContractError on horizon rows for pictures whose elevations are known.
  LineEncoder(const PictureSource& pictures, const RouteSource& route);
  /// Computes the line of an observation. Throws ContractError (FileError if the observation has a
  /// file) if the image does not show the horizon or its tilt cannot be compensated.
  [[nodiscard]] std::vector<float> line(const Observation& observation) const;

 private:
  [[nodiscard]] std::vector<float> make_line(const Panorama& panorama) const;

  RouteSource route_;
  PanoramaReader reader_;
};

/// Returns `name` if given, else the name of the only route. Throws FileError if there is no such
/// route, or there are several and none is named.
[[nodiscard]] std::string find_route_name(const MemoryFile& memory,
                                          const std::optional<std::string>& name);

/// Loads the route. Throws FileError if it has fewer than two lines, since such a route cannot be
/// followed.
[[nodiscard]] RoutePanorama load_route_to_follow(const MemoryFile& memory, const std::string& name);

}  // namespace panonav
