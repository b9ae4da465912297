#include "panonav/camera/internal/lens_pair.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace panonav::dual_fisheye {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

Matrix3d world_from_rig(const RigRotation& rotation) {
  return (Eigen::AngleAxisd(rotation.yaw_rad, Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rotation.pitch_rad, Vector3d::UnitY()) *
          Eigen::AngleAxisd(rotation.roll_rad, Vector3d::UnitX()))
      .toRotationMatrix();
}
Matrix3d rig_from_lens(const FisheyeLens& lens) {
  const FisheyeLens::Rotation rotation(lens);
  Matrix3d matrix;
  for (int i = 0; i < 3; ++i) {
    const auto axis =
        rotation.robot_from_lens({i == 0 ? 1.0 : 0.0, i == 1 ? 1.0 : 0.0, i == 2 ? 1.0 : 0.0});
    matrix.col(i) = Vector3d(axis.x, axis.y, axis.z);
  }
  return matrix;
}

}  // namespace

void add_to_parameter(FisheyeLens& lens, int parameter, double change) {
  using L = FisheyeLens;
  constexpr std::array<double L::*, lens_parameter_count> members{
      &L::centre_u_px, &L::centre_v_px, &L::focal_length_px, &L::k3,
      &L::k5,          &L::azimuth_rad, &L::elevation_rad,   &L::roll_rad};
  double& value = lens.*members[parameter];
  value = parameter == 2 ? value * std::exp(change) : value + change;
}

void add_to_parameter(RigRotation& rotation, int parameter, double change) {
  (parameter == 0   ? rotation.yaw_rad
   : parameter == 1 ? rotation.roll_rad
                    : rotation.pitch_rad) += change;
}

State apply_change(State state, const Eigen::VectorXd& change) {
  for (int lens = 0; lens < 2; ++lens) {
    for (int i = 0; i < lens_parameter_count; ++i)
      add_to_parameter(state.lenses[lens], i, change[lens_offset(lens) + i]);
  }
  for (int p = 0; p < static_cast<int>(state.rotations.size()); ++p) {
    for (int i = 0; i < rotation_parameter_count; ++i)
      add_to_parameter(state.rotations[p], i, change[rotation_offset(p) + i]);
  }
  return state;
}

Matrix3d world_from_lens(const RigRotation& rotation, const FisheyeLens& lens) {
  return world_from_rig(rotation) * rig_from_lens(lens);
}

PosedLens::PosedLens(const FisheyeLens& lens, const RigRotation& rotation, double mirror_sign)
    : lens_(lens), world_from_lens_(world_from_lens(rotation, lens)), mirror_sign_(mirror_sign) {
  // Extends the field of view by 10 %, so that rays slightly beyond the circle still have a
  // derivative.
  lens_.max_angle_rad = std::min(std::numbers::pi, 1.1 * lens_.max_angle_rad);
}

Vector3d PosedLens::ray(const Eigen::Vector2d& pixel) const {
  const double right = mirror_sign_ * (pixel.x() - lens_.centre_u_px);
  const double up = lens_.centre_v_px - pixel.y();
  const double radius = std::hypot(right, up);
  const double angle = angle_at(lens_, radius);
  const double scale = radius > 0 ? std::sin(angle) / radius : 0.0;
  return world_from_lens_ * Vector3d(std::cos(angle), -right * scale, up * scale);
}

std::vector<PosedLens> make_posed_lenses(const State& state, double mirror_sign) {
  std::vector<PosedLens> result;
  for (const RigRotation& rotation : state.rotations) {
    for (const FisheyeLens& lens : state.lenses) result.emplace_back(lens, rotation, mirror_sign);
  }
  return result;
}

}  // namespace panonav::dual_fisheye
