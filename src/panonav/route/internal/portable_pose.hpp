#pragma once

#include "panonav/core/portable_math.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Computes the distance of two points with the same bits on every processor.
[[nodiscard]] inline double portable_distance(Point2 a, Point2 b) noexcept {
  return portable::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
}

/// Transforms a point, p_in_a = a_from_b * p_in_b, with the same bits on every processor.
[[nodiscard]] inline Point2 transform(const Pose2& a_from_b, Point2 p_in_b) noexcept {
  const auto [c, s] = portable::cosine_sine(a_from_b.heading_rad);
  return {a_from_b.x_m + c * p_in_b.x_m - s * p_in_b.y_m,
          a_from_b.y_m + s * p_in_b.x_m + c * p_in_b.y_m};
}

/// Transforms a point back, p_in_b = inverse(a_from_b) * p_in_a.
[[nodiscard]] inline Point2 transform_back(const Pose2& a_from_b, Point2 p_in_a) noexcept {
  const auto [c, s] = portable::cosine_sine(a_from_b.heading_rad);
  const double x_m = p_in_a.x_m - a_from_b.x_m;
  const double y_m = p_in_a.y_m - a_from_b.y_m;
  return {c * x_m + s * y_m, c * y_m - s * x_m};
}

/// Composes transforms, a_from_c = a_from_b * b_from_c, with the same bits on every processor.
[[nodiscard]] inline Pose2 compose(const Pose2& a_from_b, const Pose2& b_from_c) noexcept {
  const Point2 place = transform(a_from_b, b_from_c.position());
  return {place.x_m, place.y_m, wrap_angle(a_from_b.heading_rad + b_from_c.heading_rad)};
}

}  // namespace panonav
