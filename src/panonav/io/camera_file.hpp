#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"
#include "panonav/io/camera_calibration.hpp"

namespace panonav {

/// A camera and its mask as stored in `camera.toml` (docs/formats.md).
struct CameraFile {
  Camera camera;              ///< valid (`validate(const Camera&)`)
  std::optional<Image> mask;  ///< grey, size of the camera's image; 0 hides the robot
  std::string format = {};    ///< empty, or the program and model of another calibration file
};

/// Reads a camera file, or the calibration file of another program (`parse_calibration`), whose
/// camera is mounted as `mount` says. Throws FileError with one line that names the field, the
/// value and the allowed values.
[[nodiscard]] CameraFile read_camera(const std::filesystem::path& path,
                                     CameraMount mount = CameraMount::up);

/// Writes the file completely or not at all; a mask is written to the same folder as NAME_mask.png.
/// Throws FileError, and ContractError for a camera that is not valid.
void write_camera(const std::filesystem::path& path, const CameraFile& camera);

}  // namespace panonav
