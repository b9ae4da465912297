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

/// Result of a calibration: the camera, and the quality of the fit.
struct DualFisheyeCalibration {
  /// Knowledge of a dual fisheye camera beyond its pictures.
  struct Knowledge {
    /// Roll of the lens in the left half, see `FisheyeLens::roll_rad`; to about 3 degrees.
    double left_roll_rad = 0.0;
    double right_roll_rad = 0.0;  ///< the same of the lens in the right half
    /// Azimuth of the left lens's axis in the robot frame, which the pictures cannot show.
    double left_azimuth_rad = 0.0;
    /// Field of view of one lens; nullopt: estimated, between 185 and 220 degrees.
    std::optional<double> field_of_view_rad;
    /// Yaw of the camera from each picture to the next, counter-clockwise viewed from above, to a
    /// few degrees; nullopt: estimated.
    std::optional<double> turn_rad;
    ColumnDirection direction = ColumnDirection::clockwise;  ///< see Camera
  };

  Camera camera;              ///< with a DualFisheyeModel, valid; its axis of turns is the vertical
  int matches = 0;            ///< matched points without outliers
  double inlier_share = 0.0;  ///< matches per patch with contrast; about 0.1 by chance
  double residual_rad = 0.0;  ///< standard deviation of a match
  /// Largest standard deviation of the azimuth of a point on the horizon, without the part common
  /// to all azimuths; from the residuals and the prior (see docs/decisions.md). Parallax of near
  /// objects is not included.
  double azimuth_deviation_rad = 0.0;
  std::vector<double> turns_rad;  ///< of each picture against the first, in [-pi, pi)
};

/// Finds the lenses of a dual fisheye camera (centres, focal lengths, distortion, rotations,
/// fields of view, gain) from pictures taken at one place while the camera is rotated about a
/// vertical axis. Patches that both lenses see, or one lens in two pictures, are matched by
/// normalised correlation; all parameters and the yaws are estimated by robust least squares
/// (Levenberg-Marquardt) with weak priors from typical cameras (docs/equations.md). If the pictures
/// do not determine the camera, returns one line with the reason. Throws ContractError on no
/// picture, different sizes, or a height below 64 px. Results are bit-identical for any number of
/// threads. Cost: some seconds for four pictures of 1280 x 640.
[[nodiscard]] std::variant<DualFisheyeCalibration, std::string> calibrate_dual_fisheye(
    std::span<const ImageView> pictures, const DualFisheyeCalibration::Knowledge& knowledge,
    Executor& executor);

}  // namespace panonav
