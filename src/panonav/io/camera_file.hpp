#pragma once

#include <filesystem>
#include <optional>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"

namespace panonav {

/// A camera as `camera.toml` holds it (docs/formats.md).
struct CameraFile {
  Camera camera;              ///< valid, as `validate(const Camera&)` asks
  std::optional<Image> mask;  ///< grey, of the camera's size; 0 where the robot itself is seen
};

/// Reads a camera file. Throws FileError with one line that names the field, the value and the
/// allowed values.
[[nodiscard]] CameraFile read_camera(const std::filesystem::path& path);

/// Writes the file whole or not at all; a mask goes beside it as NAME_mask.png. Throws FileError,
/// and ContractError for a camera that is not valid.
void write_camera(const std::filesystem::path& path, const CameraFile& camera);

}  // namespace panonav
