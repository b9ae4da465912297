#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "panonav/camera/dual_fisheye_model.hpp"

namespace panonav::dual_fisheye {

/// Rotation of the camera in one picture, relative to a world frame with the yaw of the first
/// picture.
struct RigRotation {
  double yaw_rad = 0.0, roll_rad = 0.0, pitch_rad = 0.0;
};

/// Unknowns of a calibration: both lenses, and a rotation for each picture.
struct State {
  std::array<FisheyeLens, 2> lenses;
  std::vector<RigRotation> rotations;
};

/// Number of parameters of a lens in the vector of unknowns: centre u and v (px), logarithm of the
/// focal length, k3, k5, azimuth, elevation, roll (rad).
inline constexpr int lens_parameter_count = 8;
/// Number of parameters of a rotation: yaw, roll, pitch (rad).
inline constexpr int rotation_parameter_count = 3;

/// Returns the index of a lens's first parameter in the vector of unknowns, which begins with both
/// lenses.
[[nodiscard]] constexpr int lens_offset(int lens) {
  return lens * lens_parameter_count;
}
/// Returns the index of the first parameter of a picture's rotation.
[[nodiscard]] constexpr int rotation_offset(int picture) {
  return 2 * lens_parameter_count + picture * rotation_parameter_count;
}
/// Returns the step for the numerical derivative by a lens parameter: 1e-3 px for a centre, 1e-6
/// for all others.
[[nodiscard]] constexpr double derivative_step(int parameter) {
  return parameter < 2 ? 1e-3 : 1e-6;
}

/// Adds `change` to one parameter.
void add_to_parameter(FisheyeLens& lens, int parameter, double change);
void add_to_parameter(RigRotation& rotation, int parameter, double change);
/// Returns the state after adding the vector `change` to all parameters.
[[nodiscard]] State apply_change(State state, const Eigen::VectorXd& change);

/// Returns the rotation from the frame of a lens (see `FisheyeLens::Rotation`) to the world frame.
[[nodiscard]] Eigen::Matrix3d world_from_lens(const RigRotation& rotation, const FisheyeLens& lens);

/// One lens in one picture, with its rotation computed once for many rays.
class PosedLens {
 public:
  /// `mirror_sign`: 1 where columns run clockwise, else -1.
  PosedLens(const FisheyeLens& lens, const RigRotation& rotation, double mirror_sign);
  /// Returns the direction in the world that is seen at a pixel of the image.
  [[nodiscard]] Eigen::Vector3d ray(const Eigen::Vector2d& pixel) const;

 private:
  FisheyeLens lens_;
  Eigen::Matrix3d world_from_lens_;
  double mirror_sign_;
};

/// Makes the posed lenses of all pictures: lens l of picture p has the index 2 p + l.
[[nodiscard]] std::vector<PosedLens> make_posed_lenses(const State& state, double mirror_sign);

}  // namespace panonav::dual_fisheye
