#pragma once

#include <filesystem>
#include <optional>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"

namespace panonav {

/// A camera and its mask as stored in `camera.toml` (docs/formats.md).
struct CameraFile {
  Camera camera;              ///< valid (`validate(const Camera&)`)
  std::optional<Image> mask;  ///< grey, size of the camera's image; 0 hides the robot
};

/// Reads a camera file. Throws FileError with one line that names the field, the value and the
/// allowed values.
[[nodiscard]] CameraFile read_camera(const std::filesystem::path& path);

/// Writes the file completely or not at all; a mask is written to the same folder as NAME_mask.png.
/// Throws FileError, and ContractError for a camera that is not valid.
void write_camera(const std::filesystem::path& path, const CameraFile& camera);

}  // namespace panonav
