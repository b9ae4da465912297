#include "panonav/camera/dual_fisheye_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "panonav/core/error.hpp"

namespace panonav {
namespace {

/// Returns dr / dtheta divided by the focal length.
double radius_derivative(const FisheyeLens& lens, double angle_rad) {
  const double s = angle_rad * angle_rad;
  return 1 + s * (3 * lens.k3 + s * 5 * lens.k5);
}

void validate(const FisheyeLens& lens, const std::string& name) {
  const auto finite = [&](const char* field, double value) {
    require(std::isfinite(value), name + field, value, "finite");
  };
  finite("centre_u_px", lens.centre_u_px);
  finite("centre_v_px", lens.centre_v_px);
  require(std::isfinite(lens.focal_length_px) && lens.focal_length_px > 0, name + "focal_length_px",
          lens.focal_length_px, "finite and above 0");
  finite("k3", lens.k3);
  finite("k5", lens.k5);
  require(lens.max_angle_rad > 0 && lens.max_angle_rad <= std::numbers::pi, name + "max_angle_rad",
          lens.max_angle_rad, "above 0, at most pi");
  finite("azimuth_rad", lens.azimuth_rad);
  require(std::abs(lens.elevation_rad) <= std::numbers::pi / 2, name + "elevation_rad",
          lens.elevation_rad, "-pi/2 .. pi/2");
  finite("roll_rad", lens.roll_rad);
  require(std::isfinite(lens.gain) && lens.gain > 0, name + "gain", lens.gain,
          "finite and above 0");
  // The derivative of the radius is a parabola in theta^2, so its minimum is at an end of the
  // interval or at the vertex.
  const double end = lens.max_angle_rad * lens.max_angle_rad;
  const double vertex = lens.k5 > 0 ? std::clamp(-0.3 * lens.k3 / lens.k5, 0.0, end) : end;
  for (const double s : {end, vertex}) {
    const double angle_rad = std::sqrt(s);
    require(radius_derivative(lens, angle_rad) > 0,
            name + "k3, k5: angle where the radius stops growing", angle_rad,
            "beyond max_angle_rad " + to_text(lens.max_angle_rad));
  }
}

}  // namespace

void validate(const DualFisheyeModel& model) {
  validate(model.lenses[0], "lens0_");
  validate(model.lenses[1], "lens1_");
  require(std::isfinite(model.baseline_m) && model.baseline_m >= 0, "baseline_m", model.baseline_m,
          "finite and at least 0");
}

double radius_at(const FisheyeLens& lens, double angle_rad) {
  const double s = angle_rad * angle_rad;
  return lens.focal_length_px * angle_rad * (1 + s * (lens.k3 + s * lens.k5));
}

double angle_at(const FisheyeLens& lens, double radius_px) {
  double low = 0;
  double high = lens.max_angle_rad;
  double angle = std::clamp(radius_px / lens.focal_length_px, low, high);
  for (int i = 0; i < 60; ++i) {
    const double excess = radius_at(lens, angle) - radius_px;
    (excess > 0 ? high : low) = angle;
    double next = angle - excess / (lens.focal_length_px * radius_derivative(lens, angle));
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    if (std::abs(next - angle) <= 1e-15 * lens.max_angle_rad) return next;
    angle = next;
  }
  return angle;
}

FisheyeLens::Rotation::Rotation(const FisheyeLens& lens) {
  const double ca = std::cos(lens.azimuth_rad);
  const double sa = std::sin(lens.azimuth_rad);
  const double ce = std::cos(lens.elevation_rad);
  const double se = std::sin(lens.elevation_rad);
  const double cr = std::cos(lens.roll_rad);
  const double sr = std::sin(lens.roll_rad);
  // Left and up before the roll: (-sa, ca, 0) and (-ca se, -sa se, ce).
  axes_ = {Direction3{ca * ce, sa * ce, se},
           Direction3{-sa * cr - ca * se * sr, ca * cr - sa * se * sr, ce * sr},
           Direction3{sa * sr - ca * se * cr, -ca * sr - sa * se * cr, ce * cr}};
}

Direction3 FisheyeLens::Rotation::robot_from_lens(const Direction3& d) const {
  const auto& [x, y, z] = axes_;
  return {d.x * x.x + d.y * y.x + d.z * z.x, d.x * x.y + d.y * y.y + d.z * z.y,
          d.x * x.z + d.y * y.z + d.z * z.z};
}

Direction3 FisheyeLens::Rotation::lens_from_robot(const Direction3& d) const {
  const auto along = [&d](const Direction3& axis) {
    return d.x * axis.x + d.y * axis.y + d.z * axis.z;
  };
  return {along(axes_[0]), along(axes_[1]), along(axes_[2])};
}

std::optional<FisheyeLens::Point> project(const FisheyeLens& lens, const Direction3& in_lens) {
  const double across = std::hypot(in_lens.y, in_lens.z);
  double angle = std::atan2(across, in_lens.x);
  if (angle > lens.max_angle_rad) {
    if (!(angle <= lens.max_angle_rad + 1e-9)) return std::nullopt;  // rounding
    angle = lens.max_angle_rad;
  }
  const double scale = across > 0 ? radius_at(lens, angle) / across : 0.0;
  return FisheyeLens::Point{-in_lens.y * scale, in_lens.z * scale, lens.max_angle_rad - angle};
}

std::optional<Direction3> unproject(const FisheyeLens& lens, double right_px, double up_px) {
  const double radius_px = std::hypot(right_px, up_px);
  const double rim_px = radius_at(lens, lens.max_angle_rad);
  if (!(radius_px <= rim_px * (1 + 1e-12))) return std::nullopt;
  const double angle = angle_at(lens, radius_px);
  const double scale = radius_px > 0 ? std::sin(angle) / radius_px : 0.0;
  return Direction3{std::cos(angle), -right_px * scale, up_px * scale};
}

double blend_share(double margin_rad, double other_margin_rad) {
  const double overlap_rad = margin_rad + other_margin_rad;
  if (!(overlap_rad > 0)) return 0.5;
  // Blends only in the middle half of the overlap, since real lenses are blurred and dark near
  // their borders.
  const double t = std::clamp(2 * margin_rad / overlap_rad - 0.5, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace panonav
