#pragma once

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

/// Describes how the lines of a route were made of pictures, and the source of its poses. The
/// memory stores it with the route.
struct RouteSource {
  HorizonScanlineOptions line;  ///< columns and band of the lines
  /// First and last row that show the horizon, counted from 0 at the top; for panoramas whose
  /// elevations are not known.
  std::optional<std::pair<int, int>> horizon_rows;
  bool from_odometry = false;  ///< poses are in the odometry's frame, not in the data set's
  friend bool operator==(const RouteSource&, const RouteSource&) = default;
};

/// Reads the source of the route `name`. Throws FileError when the memory says something else than
/// `store_route_source` wrote.
[[nodiscard]] RouteSource read_route_source(const MemoryFile& memory, const std::string& name,
                                            int columns);
/// Stores the source in the memory, under the route's name. Throws FileError.
void store_route_source(MemoryFile& memory, const std::string& name, const RouteSource& source);

/// Makes horizon scanlines of observations, as a route has them. Several threads may use one
/// object.
class LineEncoder {
 public:
  /// Throws ContractError on horizon rows for pictures whose elevations are known.
  LineEncoder(const PictureSource& pictures, const RouteSource& route);
  /// Throws ContractError (FileError where the observation has a file) on a picture that does not
  /// show the horizon, and on a tilt that cannot be compensated.
  [[nodiscard]] std::vector<float> line(const Observation& observation) const;

 private:
  [[nodiscard]] std::vector<float> make_line(const Panorama& panorama) const;

  RouteSource route_;
  PanoramaReader reader_;
};

/// Returns the route's name, that of the only route where none is named. Throws FileError when
/// there is no such route, or several and none is named.
[[nodiscard]] std::string find_route_name(const MemoryFile& memory,
                                          const std::optional<std::string>& name);

/// Returns the route itself. Throws FileError when it has fewer than two lines: nothing can be
/// followed.
[[nodiscard]] RoutePanorama load_route_to_follow(const MemoryFile& memory, const std::string& name);

}  // namespace panonav
