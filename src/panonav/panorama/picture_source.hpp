#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/panorama/picture.hpp"

namespace panonav {

/// Kind of the pictures of a recording.
enum class PictureKind {
  panorama,         ///< ready-made panoramic cylinders
  equirectangular,  ///< 360 degree pictures of the whole sphere, twice as wide as high
  mirror,           ///< raw images of a mirror or fisheye camera with a vertical axis
  pinhole           ///< pictures of a part of the azimuth, such as a phone's; not for memories
};

/// Names of the kinds in files and options, in the order of `PictureKind`.
inline constexpr std::array<std::string_view, 4> picture_kind_names{"panorama", "equirectangular",
                                                                    "mirror", "pinhole"};

/// Returns the name of a kind.
[[nodiscard]] constexpr std::string_view to_string(PictureKind kind) noexcept {
  return picture_kind_names[static_cast<std::size_t>(kind)];
}

/// Band that is cut out of equirectangular pictures if no other band is stated. Floor and ceiling
/// look similar at many places: on the walk indoor_walk_360, 37 of 117 images are most similar to
/// the next or the previous one, with the whole sphere 27 (of ciirc_b670, 30 and 22 of 31).
inline constexpr ElevationBand default_equirectangular_band{radians(-30.0), radians(40.0)};

/// Layout of the pictures of a recording, from which they become panoramic cylinders.
struct PictureSource {
  PictureKind kind = PictureKind::panorama;  ///< decides which other members are used
  /// Panorama and equirectangular: layout of columns and rows. Equirectangular: `elevations` that
  /// are not set are the whole sphere, and `kept_elevations` that are not set are
  /// `default_equirectangular_band`. Mirror: only `kept_elevations` is used, the band to unwarp;
  /// nullopt: all elevations that the camera sees at every azimuth.
  PictureLayout layout;
  std::optional<Camera> camera;  ///< mirror: always; pinhole: if known; not for other kinds
  /// Pinhole without a camera: angle between the left and the right edge of each picture, on whose
  /// middle the optical axis is; nullopt: the focal length in the EXIF data of each picture.
  std::optional<double> field_of_view_rad = std::nullopt;
  /// Mirror: grey, of the camera's size; pixels of value 0 show the robot itself. Panorama values
  /// that depend on these pixels are interpolated (see `fill_hidden_values`).
  std::optional<Image> mask;
  friend bool operator==(const PictureSource&, const PictureSource&) = default;
};

}  // namespace panonav
