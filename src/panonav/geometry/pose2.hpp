#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "panonav/geometry/angles.hpp"

namespace panonav {

/// A point in the plane; variable names state its frame.
struct Point2 {
  double x_m = 0.0;  ///< forward, or along the frame's first axis
  double y_m = 0.0;  ///< left, or along its second axis
  friend bool operator==(const Point2&, const Point2&) = default;
};

/// Euclidean distance of two points of one frame, in metres.
[[nodiscard]] inline double distance(Point2 a, Point2 b) {
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
}

/// Position and heading in the plane; x forward, y left, heading counter-clockwise (REP 103). As a
/// transform, `a_from_b` is the pose of frame b in frame a.
struct Pose2 {
  double x_m = 0.0;          ///< position along the frame's x axis
  double y_m = 0.0;          ///< position along its y axis
  double heading_rad = 0.0;  ///< in [-pi, pi) for every pose that panonav makes

  [[nodiscard]] Point2 position() const { return {x_m, y_m}; }  ///< The pose without its heading.
  friend bool operator==(const Pose2&, const Pose2&) = default;
};

/// Returns the positions of poses, in their order.
[[nodiscard]] inline std::vector<Point2> positions_of(std::span<const Pose2> poses) {
  std::vector<Point2> positions;
  positions.reserve(poses.size());
  for (const Pose2& pose : poses) positions.push_back(pose.position());
  return positions;
}

/// True if none of the three numbers is NaN or infinite.
[[nodiscard]] inline bool is_finite(const Pose2& pose) {
  return std::isfinite(pose.x_m) && std::isfinite(pose.y_m) && std::isfinite(pose.heading_rad);
}

/// Composes transforms: a_from_c = a_from_b * b_from_c.
[[nodiscard]] inline Pose2 operator*(const Pose2& a_from_b, const Pose2& b_from_c) {
  const double c = std::cos(a_from_b.heading_rad);
  const double s = std::sin(a_from_b.heading_rad);
  return {a_from_b.x_m + c * b_from_c.x_m - s * b_from_c.y_m,
          a_from_b.y_m + s * b_from_c.x_m + c * b_from_c.y_m,
          wrap_angle(a_from_b.heading_rad + b_from_c.heading_rad)};
}

/// Inverts a transform: returns b_from_a.
[[nodiscard]] inline Pose2 inverse(const Pose2& a_from_b) {
  const double c = std::cos(a_from_b.heading_rad);
  const double s = std::sin(a_from_b.heading_rad);
  return {-c * a_from_b.x_m - s * a_from_b.y_m, s * a_from_b.x_m - c * a_from_b.y_m,
          wrap_angle(-a_from_b.heading_rad)};
}

/// Transforms a point: p_in_a = a_from_b * p_in_b.
[[nodiscard]] inline Point2 operator*(const Pose2& a_from_b, Point2 p_in_b) {
  const double c = std::cos(a_from_b.heading_rad);
  const double s = std::sin(a_from_b.heading_rad);
  return {a_from_b.x_m + c * p_in_b.x_m - s * p_in_b.y_m,
          a_from_b.y_m + s * p_in_b.x_m + c * p_in_b.y_m};
}

/// A direction in space: x forward, y left, z up. Not necessarily of unit length.
struct Direction3 {
  double x = 1.0;  ///< forward
  double y = 0.0;  ///< left
  double z = 0.0;  ///< up

  /// Azimuth counter-clockwise from x, viewed from above, in [-pi, pi]; 0 for vertical directions.
  [[nodiscard]] double azimuth_rad() const { return std::atan2(y, x); }
  /// Elevation above the horizon, in [-pi/2, pi/2].
  [[nodiscard]] double elevation_rad() const { return std::atan2(z, std::hypot(x, y)); }
  /// Makes the unit direction with this azimuth and elevation.
  [[nodiscard]] static Direction3 from_angles(double azimuth_rad, double elevation_rad) {
    return {std::cos(elevation_rad) * std::cos(azimuth_rad),
            std::cos(elevation_rad) * std::sin(azimuth_rad), std::sin(elevation_rad)};
  }
  friend bool operator==(const Direction3&, const Direction3&) = default;
};

}  // namespace panonav
