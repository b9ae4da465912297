#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "panonav/camera/dual_fisheye_model.hpp"

namespace panonav::dual_fisheye {

/// How the camera stood when a picture was taken, against the first picture's vertical axis.
struct Stand {
  double yaw_rad = 0.0, roll_rad = 0.0, pitch_rad = 0.0;
};

/// What a calibration looks for: both lenses, and a stand for each picture.
struct State {
  std::array<FisheyeLens, 2> lenses;
  std::vector<Stand> stands;
};

/// Parameters of a lens in the vector of unknowns: centre u and v (px), logarithm of the focal
/// length, k3, k5, azimuth, elevation, roll (rad).
inline constexpr int lens_size = 8;
/// Parameters of a stand: yaw, roll, pitch (rad).
inline constexpr int stand_size = 3;

/// Returns the index of a lens's first parameter: those of both lenses come first.
[[nodiscard]] constexpr int lens_at(int lens) {
  return lens * lens_size;
}
/// Returns the index of the first parameter of a picture's stand.
[[nodiscard]] constexpr int stand_at(int picture) {
  return 2 * lens_size + picture * stand_size;
}
/// Returns the change of a parameter over which its slope is taken: thousandths of a pixel for a
/// centre, millionths for all else.
[[nodiscard]] constexpr double slope_step(int parameter) {
  return parameter < 2 ? 1e-3 : 1e-6;
}

/// Adds `change` to one parameter.
void add_to(FisheyeLens& lens, int parameter, double change);
void add_to(Stand& stand, int parameter, double change);
/// Returns the state with all parameters changed.
[[nodiscard]] State moved(State state, const Eigen::VectorXd& change);

/// Returns the rotation from the frame of a lens to the world's: x along its axis.
[[nodiscard]] Eigen::Matrix3d world_from_lens(const Stand& stand, const FisheyeLens& lens);

/// One lens in one picture, ready for many rays.
class Stance {
 public:
  /// `side`: 1 where columns run clockwise, else -1.
  Stance(const FisheyeLens& lens, const Stand& stand, double side);
  /// Returns the direction in the world that is seen at a pixel of the image.
  [[nodiscard]] Eigen::Vector3d ray(const Eigen::Vector2d& pixel) const;

 private:
  FisheyeLens lens_;
  Eigen::Matrix3d world_from_lens_;
  double side_;
};

/// Returns the stances of both lenses in all pictures: that of lens l in picture p is 2 p + l.
[[nodiscard]] std::vector<Stance> stances(const State& state, double side);

}  // namespace panonav::dual_fisheye
