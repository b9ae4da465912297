#include "panonav/motion/headed_path.hpp"

#include <cmath>
#include <cstddef>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

std::vector<Pose2> headed_along_way(std::span<const Point2> positions, double reach_m) {
  require(reach_m >= 0.0, "reach_m", reach_m, ">= 0");
  std::vector<double> way_m;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    way_m.push_back(i == 0 ? 0.0 : way_m.back() + distance(positions[i - 1], positions[i]));
  }
  std::vector<Pose2> headed;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    std::size_t low = i;
    std::size_t high = i;
    while (low > 0 && way_m[i] - way_m[low - 1] <= reach_m) --low;
    while (high + 1 < positions.size() && way_m[high + 1] - way_m[i] <= reach_m) ++high;
    if (low == high) {
      low = low > 0 ? low - 1 : low;
      high = high + 1 < positions.size() ? high + 1 : high;
    }
    // Position by way in least squares: the slopes of x and y are the direction.
    double n = 0.0;
    double s = 0.0;
    double x = 0.0;
    double y = 0.0;
    double sx = 0.0;
    double sy = 0.0;
    for (std::size_t j = low; j <= high; ++j) {
      n += 1.0;
      s += way_m[j] - way_m[i];
      x += positions[j].x_m;
      y += positions[j].y_m;
      sx += (way_m[j] - way_m[i]) * positions[j].x_m;
      sy += (way_m[j] - way_m[i]) * positions[j].y_m;
    }
    headed.push_back({positions[i].x_m, positions[i].y_m,
                      wrap_angle(std::atan2(sy - s * y / n, sx - s * x / n))});
  }
  return headed;
}

}  // namespace panonav
