#pragma once

#include <array>
#include <cmath>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// A point in space; variable names state its frame.
struct Point3 {
  double x_m = 0.0;  ///< along the frame's first axis
  double y_m = 0.0;  ///< along its second axis
  double z_m = 0.0;  ///< along its third axis
  friend bool operator==(const Point3&, const Point3&) = default;
};

/// Euclidean distance of two points of one frame, in metres.
[[nodiscard]] inline double distance(const Point3& a, const Point3& b) {
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m, a.z_m - b.z_m);
}

/// A rotation in space as a quaternion of unit length; q and -q are the same rotation.
struct Rotation3 {
  double w = 1.0;  ///< cosine of half the angle
  double x = 0.0;  ///< x of the axis, times the sine of half the angle
  double y = 0.0;  ///< the same along y
  double z = 0.0;  ///< the same along z

  /// Makes the rotation about z by an angle, counter-clockwise seen from above.
  [[nodiscard]] static Rotation3 from_yaw(double yaw_rad) {
    return {std::cos(0.5 * yaw_rad), 0.0, 0.0, std::sin(0.5 * yaw_rad)};
  }
  /// Makes the rotation nearest to a matrix of nine numbers, row by row, that is a rotation up to
  /// rounding.
  [[nodiscard]] static Rotation3 from_matrix(const std::array<double, 9>& rows);

  /// Angle of the rotation, in [0, pi].
  [[nodiscard]] double angle_rad() const {
    return 2.0 * std::atan2(std::hypot(x, y, z), std::abs(w));
  }
  /// Angle of the projection of the rotated x axis to the plane z = 0, in [-pi, pi].
  [[nodiscard]] double yaw_rad() const {
    return std::atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z);
  }
  friend bool operator==(const Rotation3&, const Rotation3&) = default;
};

/// Composes rotations: a_from_c = a_from_b * b_from_c.
[[nodiscard]] inline Rotation3 operator*(const Rotation3& a, const Rotation3& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

/// Inverts a rotation: returns b_from_a.
[[nodiscard]] inline Rotation3 inverse(const Rotation3& a_from_b) {
  return {a_from_b.w, -a_from_b.x, -a_from_b.y, -a_from_b.z};
}

/// Rotates a point about the origin: p_in_a = a_from_b * p_in_b.
[[nodiscard]] inline Point3 operator*(const Rotation3& q, const Point3& p) {
  const double tx = 2.0 * (q.y * p.z_m - q.z * p.y_m);
  const double ty = 2.0 * (q.z * p.x_m - q.x * p.z_m);
  const double tz = 2.0 * (q.x * p.y_m - q.y * p.x_m);
  return {p.x_m + q.w * tx + q.y * tz - q.z * ty, p.y_m + q.w * ty + q.z * tx - q.x * tz,
          p.z_m + q.w * tz + q.x * ty - q.y * tx};
}

/// Position and orientation in space. As a transform, `a_from_b` is the pose of frame b in frame a.
struct Pose3 {
  Point3 position;     ///< of the origin of b in a
  Rotation3 rotation;  ///< a_from_b
  friend bool operator==(const Pose3&, const Pose3&) = default;
};

/// Composes transforms: a_from_c = a_from_b * b_from_c.
[[nodiscard]] inline Pose3 operator*(const Pose3& a_from_b, const Pose3& b_from_c) {
  const Point3 p = a_from_b.rotation * b_from_c.position;
  return {
      {a_from_b.position.x_m + p.x_m, a_from_b.position.y_m + p.y_m, a_from_b.position.z_m + p.z_m},
      a_from_b.rotation * b_from_c.rotation};
}

/// Inverts a transform: returns b_from_a.
[[nodiscard]] inline Pose3 inverse(const Pose3& a_from_b) {
  const Rotation3 b_from_a = inverse(a_from_b.rotation);
  const Point3 p = b_from_a * a_from_b.position;
  return {{-p.x_m, -p.y_m, -p.z_m}, b_from_a};
}

/// Returns the pose in space at height 0.
[[nodiscard]] inline Pose3 to_pose3(const Pose2& pose) {
  return {{pose.x_m, pose.y_m, 0.0}, Rotation3::from_yaw(pose.heading_rad)};
}

/// Projects a pose to the plane z = 0: x, y and yaw.
[[nodiscard]] inline Pose2 to_pose2(const Pose3& pose) {
  return {pose.position.x_m, pose.position.y_m, wrap_angle(pose.rotation.yaw_rad())};
}

}  // namespace panonav
