#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "panonav/camera/dual_fisheye_model.hpp"

namespace panonav::dual_fisheye {

/// Rotation of the camera in a picture against the first picture's vertical axis.
struct RigRotation {
  double yaw_rad = 0.0, roll_rad = 0.0, pitch_rad = 0.0;
};

/// Unknowns of a calibration: both lenses, and a rotation for each picture.
struct State {
  std::array<FisheyeLens, 2> lenses;
  std::vector<RigRotation> rotations;
};

/// Parameters of a lens in the vector of unknowns: centre u and v (px), logarithm of the focal
/// length, k3, k5, azimuth, elevation, roll (rad).
inline constexpr int lens_size = 8;
/// Parameters of a rotation: yaw, roll, pitch (rad).
inline constexpr int rotation_size = 3;

/// Returns the index of a lens's first parameter: those of both lenses come first.
[[nodiscard]] constexpr int lens_at(int lens) {
  return lens * lens_size;
}
/// Returns the index of the first parameter of a picture's rotation.
[[nodiscard]] constexpr int rotation_at(int picture) {
  return 2 * lens_size + picture * rotation_size;
}
/// Returns the step of a parameter for its numerical derivative: thousandths of a pixel for a
/// centre, millionths for all others.
[[nodiscard]] constexpr double get_derivative_step(int parameter) {
  return parameter < 2 ? 1e-3 : 1e-6;
}

/// Adds `change` to one parameter.
void add_to(FisheyeLens& lens, int parameter, double change);
void add_to(RigRotation& rotation, int parameter, double change);
/// Returns the state with all parameters changed.
[[nodiscard]] State apply_change(State state, const Eigen::VectorXd& change);

/// Returns the rotation from the frame of a lens to the world's: x along its axis.
[[nodiscard]] Eigen::Matrix3d world_from_lens(const RigRotation& rotation, const FisheyeLens& lens);

/// One lens in one picture, ready for many rays.
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

/// Poses both lenses in all pictures: lens l in picture p has the index 2 p + l.
[[nodiscard]] std::vector<PosedLens> make_posed_lenses(const State& state, double mirror_sign);

}  // namespace panonav::dual_fisheye
