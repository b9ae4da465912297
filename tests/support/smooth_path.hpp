#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav_simulation/paths.hpp"

namespace panonav::testing {

inline Point2 mix(Point2 a, Point2 b, double fraction) {
  return {a.x_m + fraction * (b.x_m - a.x_m), a.y_m + fraction * (b.y_m - a.y_m)};
}

// One span of a Catmull-Rom spline between p[1] and p[2] (Barry and Goldman's pyramid).
class SplineSpan {
 public:
  explicit SplineSpan(const std::array<Point2, 4>& points) : points_(points) {
    for (std::size_t i = 1; i < 4; ++i) {
      // The square root of the distance makes the parametrisation centripetal.
      knots_[i] = knots_[i - 1] + std::sqrt(distance(points[i - 1], points[i]));
    }
  }

  // fraction 0 .. 1 between p[1] and p[2]
  [[nodiscard]] Point2 at(double fraction) const {
    const double t = knots_[1] + fraction * (knots_[2] - knots_[1]);
    std::array<Point2, 4> level = points_;
    for (std::size_t depth = 1; depth < 4; ++depth) {
      for (std::size_t i = 0; i + depth < 4; ++i) {
        // The last two levels interpolate over the inner knots only.
        const std::size_t low = depth == 3 ? 1 : i;
        const std::size_t high = depth == 3 ? 2 : i + depth;
        level[i] = mix(level[i], level[i + 1], (t - knots_[low]) / (knots_[high] - knots_[low]));
      }
    }
    return level[0];
  }

 private:
  std::array<Point2, 4> points_;
  std::array<double, 4> knots_{};
};

inline Point2 mirrored(Point2 end, Point2 inner) {
  return {2.0 * end.x_m - inner.x_m, 2.0 * end.y_m - inner.y_m};
}

/// A smooth curve through at least two different way points as poses at equal spacing, heading
/// along the tangent: a centripetal Catmull-Rom spline (Yuksel et al. 2011).
inline std::vector<Pose2> smooth_path(const std::vector<Point2>& points, double spacing_m) {
  const std::size_t last = points.size() - 1;
  // A polyline so fine that its chords and the curve differ by far less than the spacing.
  std::vector<Pose2> fine;
  for (std::size_t i = 0; i < last; ++i) {
    const SplineSpan span(
        {i > 0 ? points[i - 1] : mirrored(points[0], points[1]), points[i], points[i + 1],
         i + 2 > last ? mirrored(points[last], points[last - 1]) : points[i + 2]});
    const int pieces = std::max(
        16, static_cast<int>(std::ceil(20.0 * distance(points[i], points[i + 1]) / spacing_m)));
    const double h = 1e-3 / pieces;
    for (int piece = i > 0 ? 1 : 0; piece <= pieces; ++piece) {
      const double fraction = static_cast<double>(piece) / pieces;
      const Point2 position = span.at(fraction);
      const Point2 before = span.at(std::max(0.0, fraction - h));
      const Point2 after = span.at(std::min(1.0, fraction + h));
      const double heading = std::atan2(after.y_m - before.y_m, after.x_m - before.x_m);
      fine.push_back({position.x_m, position.y_m, wrap_angle(heading)});
    }
  }
  return simulation::resample(fine, spacing_m);
}

}  // namespace panonav::testing
