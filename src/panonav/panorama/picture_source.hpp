#pragma once

#include <optional>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"
#include "panonav/panorama/picture.hpp"

namespace panonav {

/// Kind of the pictures of a recording.
enum class PictureKind {
  panorama,         ///< ready-made panoramic cylinders
  equirectangular,  ///< 360 degree pictures, the whole sphere
  mirror            ///< raw images of a mirror or fisheye camera with a vertical axis
};

/// Layout of the pictures of a recording, from which they become panoramic cylinders.
struct PictureSource {
  PictureKind kind = PictureKind::panorama;  ///< decides which other members are used
  /// Panorama and equirectangular: layout of columns and rows. Mirror: only `kept_elevations` is
  /// used, the band to unwarp; nullopt: all elevations that the camera sees at every azimuth.
  PictureLayout layout;
  std::optional<Camera> camera;  ///< mirror, and only there
  /// Mirror: grey, of the camera's size; pixels of value 0 show the robot itself. Panorama values
  /// that depend on these pixels are interpolated (see `fill_hidden_values`).
  std::optional<Image> mask;
  friend bool operator==(const PictureSource&, const PictureSource&) = default;
};

}  // namespace panonav
