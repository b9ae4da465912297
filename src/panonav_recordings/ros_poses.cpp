#include "panonav_recordings/ros_messages.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose3.hpp"

namespace panonav::recordings::ros {

namespace {

double dot(const Quaternion& a, const Quaternion& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
}

Quaternion operator*(const Quaternion& a, const Quaternion& b) {
  return {
      a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
      a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

Vector3 rotate(const Quaternion& q, const Vector3& v) {
  const Quaternion rotated = q * Quaternion{v.x, v.y, v.z, 0.0} * Quaternion{-q.x, -q.y, -q.z, q.w};
  const double scale = 1.0 / dot(q, q);
  return {scale * rotated.x, scale * rotated.y, scale * rotated.z};
}

}  // namespace

Pose operator*(const Pose& a_from_b, const Pose& b_from_c) {
  const Vector3 moved = rotate(a_from_b.orientation, b_from_c.position);
  const Vector3& at = a_from_b.position;
  return {{at.x + moved.x, at.y + moved.y, at.z + moved.z},
          a_from_b.orientation * b_from_c.orientation};
}

Pose inverse(const Pose& a_from_b) {
  const Quaternion& q = a_from_b.orientation;
  const Quaternion back{-q.x, -q.y, -q.z, q.w};
  const Vector3 at = rotate(back, a_from_b.position);
  return {{-at.x, -at.y, -at.z}, back};
}

Pose interpolate(const Pose& a, const Pose& b, double share) {
  if (share == 0.0) return a;
  if (share == 1.0) return b;
  const Quaternion& q = a.orientation;
  const Quaternion& r = b.orientation;
  const double cosine = dot(q, r) / std::sqrt(dot(q, q) * dot(r, r));
  const double angle = std::acos(std::min(std::abs(cosine), 1.0));
  // q and -q are the same orientation; the sign selects the shorter rotation.
  const double sign = cosine < 0.0 ? -1.0 : 1.0;
  constexpr double straight_rad = 1e-6;
  const double of_a = angle < straight_rad ? 1.0 - share : std::sin((1.0 - share) * angle);
  const double of_b = sign * (angle < straight_rad ? share : std::sin(share * angle));
  Quaternion mixed{of_a * q.x + of_b * r.x, of_a * q.y + of_b * r.y, of_a * q.z + of_b * r.z,
                   of_a * q.w + of_b * r.w};
  const double scale = 1.0 / std::sqrt(dot(mixed, mixed));
  mixed = {scale * mixed.x, scale * mixed.y, scale * mixed.z, scale * mixed.w};
  return {
      {std::lerp(a.position.x, b.position.x, share), std::lerp(a.position.y, b.position.y, share),
       std::lerp(a.position.z, b.position.z, share)},
      mixed};
}

Pose to_pose(const Pose2& pose, const Tilt& tilt) {
  const auto about = [](double angle_rad) {
    return std::pair{std::sin(0.5 * angle_rad), std::cos(0.5 * angle_rad)};
  };
  const auto [sz, cz] = about(pose.heading_rad);
  const auto [sy, cy] = about(tilt.pitch_rad);
  const auto [sx, cx] = about(tilt.roll_rad);
  return {
      {pose.x_m, pose.y_m, 0.0},
      Quaternion{0.0, 0.0, sz, cz} * Quaternion{0.0, sy, 0.0, cy} * Quaternion{sx, 0.0, 0.0, cx}};
}

Pose2 to_pose2(const Pose& pose) {
  const auto& [x, y, z, w] = pose.orientation;
  return {pose.position.x, pose.position.y, wrap_angle(Rotation3{w, x, y, z}.yaw_rad())};
}

Tilt to_tilt(const Quaternion& orientation) {
  const auto& [x, y, z, w] = orientation;
  const double sine = 2.0 * (w * y - z * x) / dot(orientation, orientation);
  return {std::atan2(2.0 * (w * x + y * z), w * w - x * x - y * y + z * z),
          std::asin(std::clamp(sine, -1.0, 1.0))};
}

}  // namespace panonav::recordings::ros
