#include "panonav/motion/path.hpp"

#include <cmath>

#include "panonav/core/error.hpp"

namespace panonav {

double path_length_m(std::span<const Pose2> path) {
  double length_m = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    length_m += distance(path[i - 1].position(), path[i].position());
  }
  return length_m;
}

double path_length_m(std::span<const Point2> path) {
  double length_m = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) length_m += distance(path[i - 1], path[i]);
  return length_m;
}

std::vector<Pose2> estimate_headings(std::span<const Point2> positions, double window_m) {
  require(window_m >= 0.0, "window_m", window_m, ">= 0");
  std::vector<double> along_m;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    along_m.push_back(i == 0 ? 0.0 : along_m.back() + distance(positions[i - 1], positions[i]));
  }
  std::vector<Pose2> poses;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    std::size_t low = i;
    std::size_t high = i;
    while (low > 0 && along_m[i] - along_m[low - 1] <= window_m) --low;
    while (high + 1 < positions.size() && along_m[high + 1] - along_m[i] <= window_m) ++high;
    if (low == high) {
      low = low > 0 ? low - 1 : low;
      high = high + 1 < positions.size() ? high + 1 : high;
    }
    // Regression of x and y on the path length; their slopes are the direction of motion.
    double n = 0.0;
    double s = 0.0;
    double x = 0.0;
    double y = 0.0;
    double sx = 0.0;
    double sy = 0.0;
    for (std::size_t j = low; j <= high; ++j) {
      n += 1.0;
      s += along_m[j] - along_m[i];
      x += positions[j].x_m;
      y += positions[j].y_m;
      sx += (along_m[j] - along_m[i]) * positions[j].x_m;
      sy += (along_m[j] - along_m[i]) * positions[j].y_m;
    }
    poses.push_back({positions[i].x_m, positions[i].y_m,
                     wrap_angle(std::atan2(sy - s * y / n, sx - s * x / n))});
  }
  return poses;
}

}  // namespace panonav
