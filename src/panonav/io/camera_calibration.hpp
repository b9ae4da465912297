#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "panonav/camera/camera.hpp"

namespace panonav {

/// Mounting of a camera on the robot, which calibrations of other programs do not contain. In all
/// cases the picture's right (+u) is forward.
enum class CameraMount {
  up,     ///< a lens that looks up
  down,   ///< a lens that looks down
  mirror  ///< a camera that looks up into a mirror
};

/// Calibration file of another program.
enum class CalibrationFormat {
  ocamcalib,  ///< calib_results.txt of OCamCalib
  yaml        ///< Kalibr, OpenCV, ROS or stella_vslam
};

/// A camera from a calibration file of another program.
struct CalibratedCamera {
  std::string format;  ///< program and model for people: "Kalibr (pinhole-equi)"
  Camera camera;       ///< valid
};

/// Identifies the calibration file of another program by its first line of data; nullopt for TOML
/// and everything else.
[[nodiscard]] std::optional<CalibrationFormat> identify_calibration(std::string_view text);

/// Reads a calibration file of another program (docs/conventions.md). `path` is for messages.
/// Models that no model of `Camera` represents exactly (double sphere, extended unified) are fitted
/// within 0.002 degrees, up to a smaller rim if necessary. A perspective camera looks forward,
/// whatever `mount` is. Throws FileError that names the field.
[[nodiscard]] CalibratedCamera parse_calibration(const std::filesystem::path& path,
                                                 std::string_view text, CalibrationFormat format,
                                                 CameraMount mount);

/// Programs for which `write_calibration` writes files.
enum class ExportFormat {
  kalibr,  ///< camchain of one camera
  opencv   ///< FileStorage with K, D and, for the model of Mei, xi
};

/// Writes the camera as a Kalibr camchain or an OpenCV YAML file, as model pinhole-equi or
/// cv::fisheye (of a `FisheyeModel`) or else as model omni of Mei, whose parameters are fitted if
/// necessary; completely or not at all. Returns the largest difference of elevations, in radians.
/// Throws ContractError if it exceeds 0.05 degrees, or for an equirectangular, dual fisheye or
/// pinhole camera; FileError.
double write_calibration(const std::filesystem::path& path, const Camera& camera,
                         ExportFormat format);

}  // namespace panonav
