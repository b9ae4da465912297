#pragma once

#include <optional>

#include "panonav/camera/dual_fisheye_model.hpp"
#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Pinhole lens with square pixels, such as that of a phone or of a robot's forward camera: a
/// direction at the angle theta from the optical axis is imaged at the distance r = f tan(theta)
/// from the centre. Shows a part of the azimuth only. Valid for theta below a right angle.
struct PinholeModel {
  /// Offset of an image point from the centre.
  struct Offset {
    double right_px = 0.0;  ///< along u
    double up_px = 0.0;     ///< against v
  };

  double focal_length_px = 500.0;  ///< above 0
  double azimuth_rad = 0.0;        ///< of the optical axis in the robot frame
  double elevation_rad = 0.0;      ///< of the optical axis above the horizon
  /// Right-handed rotation about the viewing direction, as `FisheyeLens::roll_rad`.
  double roll_rad = 0.0;
  friend bool operator==(const PinholeModel&, const PinholeModel&) = default;
};

/// Smallest accepted field of view along a picture's width, in radians: 10 degrees.
inline constexpr double min_field_of_view_rad = 0.17453292519943295;
/// Largest accepted field of view along a picture's width, in radians: 150 degrees.
inline constexpr double max_field_of_view_rad = 2.6179938779914944;
/// True if a field of view is accepted; false for NaN.
[[nodiscard]] constexpr bool is_field_of_view(double field_of_view_rad) noexcept {
  return field_of_view_rad >= min_field_of_view_rad && field_of_view_rad <= max_field_of_view_rad;
}

/// Throws ContractError that names the field, its value and its range.
void validate(const PinholeModel& model);

/// Returns the rotation of the lens in the robot frame.
[[nodiscard]] FisheyeLens::Rotation find_rotation(const PinholeModel& model);
/// Projects a direction of the lens frame to the offset from the centre; nullopt behind the lens.
[[nodiscard]] std::optional<PinholeModel::Offset> project(const PinholeModel& model,
                                                          const Direction3& in_lens);
/// Returns the unit direction in the robot frame that an offset from the centre shows.
[[nodiscard]] Direction3 unproject(const PinholeModel& model, double right_px, double up_px);

/// Returns the focal length in pixels of a picture of this width and field of view (the angle
/// between its left and right edges). Throws ContractError on a field of view out of range.
[[nodiscard]] double focal_length_from_field_of_view(int width_px, double field_of_view_rad);
/// Returns the focal length in pixels of a picture whose EXIF data state a focal length for 35 mm
/// film, which compares diagonals (43.27 mm) [EXIF 2.32, tag 0xA405]. Throws ContractError unless
/// it is above 0.
[[nodiscard]] double focal_length_from_35mm(ImageSize size, double focal_length_mm);

}  // namespace panonav
