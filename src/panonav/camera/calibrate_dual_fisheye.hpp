#pragma once

#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/image.hpp"

namespace panonav {

/// A camera found in pictures, and how well it fits them.
struct DualFisheyeCalibration {
  /// Knowledge of a dual fisheye camera beyond its pictures.
  struct Knowledge {
    /// Roll of the lens in the left half, see `FisheyeLens::roll_rad`; to about 3 degrees.
    double left_roll_rad = 0.0;
    double right_roll_rad = 0.0;  ///< the same of the lens in the right half
    /// Azimuth of the left lens's axis: no picture shows where the robot's forward direction is.
    double left_azimuth_rad = 0.0;
    /// Field of view of one lens; empty: found, between 185 and 220 degrees.
    std::optional<double> field_of_view_rad;
    /// Yaw of the camera from each picture to the next, counter-clockwise seen from above, to
    /// some degrees; empty: found.
    std::optional<double> turn_rad;
    ColumnDirection direction = ColumnDirection::clockwise;  ///< see Camera
  };

  Camera camera;              ///< with a DualFisheyeModel, valid; its axis of turns is the vertical
  int matches = 0;            ///< points found twice, outliers not counted
  double inlier_share = 0.0;  ///< of the textured places looked at; some 0.1 by chance
  double residual_rad = 0.0;  ///< standard deviation of a match
  /// Largest standard deviation of the azimuth in which the cylinder shows something on the
  /// horizon, less what is the same all round; from the residuals and what is known of lenses
  /// before (see docs/decisions.md). Near things and the distance of the lenses are not in it.
  double azimuth_deviation_rad = 0.0;
  std::vector<double> turns_rad;  ///< of each picture against the first, in [-pi, pi)
};

/// Finds the lenses of a dual fisheye camera (centres, focal lengths, distortion, rotations, fields
/// of view, gain) from pictures of one place, between which the camera is turned about its vertical
/// axis, which becomes the vertical. Patches that both lenses see, or one lens in two pictures, are
/// matched by normalised correlation; all parameters and the yaws follow by robust least squares
/// (Levenberg-Marquardt) with weak priors of how cameras are made (docs/equations.md). Returns one
/// line that says what the pictures lack where they do not determine the camera. Throws
/// ContractError on no picture, different sizes, or a height below 64 px. The same bits on any
/// number of threads. Cost: some seconds for four pictures of 1280 x 640.
[[nodiscard]] std::variant<DualFisheyeCalibration, std::string> calibrate_dual_fisheye(
    std::span<const ImageView> pictures, const DualFisheyeCalibration::Knowledge& known,
    Executor& executor);

}  // namespace panonav
