#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <variant>

#include "panonav/camera/dual_fisheye_model.hpp"
#include "panonav/camera/equiangular_model.hpp"
#include "panonav/camera/fisheye_model.hpp"
#include "panonav/camera/hyperboloidal_model.hpp"
#include "panonav/camera/pinhole_model.hpp"
#include "panonav/camera/polynomial_model.hpp"
#include "panonav/camera/rig_model.hpp"
#include "panonav/camera/unified_model.hpp"
#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// A point of the continuous image plane; the centre of pixel (u, v) lies at (u + 0.5, v + 0.5).
struct PixelPoint {
  double u_px = 0.0;  ///< from the left edge
  double v_px = 0.0;  ///< from the upper edge
  friend bool operator==(const PixelPoint&, const PixelPoint&) = default;
};

/// A 360 degree picture or a ready-made panorama: columns are azimuths, rows are elevations, both
/// linear. The width is one full turn. Valid for elevations from bottom to top.
struct EquirectangularModel {
  double elevation_bottom_rad = -1.5707963267948966;  ///< of the picture's lower edge
  double elevation_top_rad = 1.5707963267948966;      ///< of the picture's upper edge
  friend bool operator==(const EquirectangularModel&, const EquirectangularModel&) = default;
};

/// Any of the projection models, each defined in its own header. All code that enumerates models
/// uses this list.
using CameraModel =
    std::variant<HyperboloidalModel, PolynomialModel, UnifiedModel, EquiangularModel,
                 EquirectangularModel, DualFisheyeModel, FisheyeModel, PinholeModel, RigModel>;

/// Sense of rotation in which azimuths run in a picture; `Camera::direction` gives its exact
/// meaning for each model.
enum class ColumnDirection {
  clockwise,         ///< azimuths grow against the columns or the image angle
  counter_clockwise  ///< azimuths grow with them
};
/// Names of the senses of rotation in files, in the order of `ColumnDirection`.
inline constexpr std::array<std::string_view, 2> column_direction_names{"clockwise",
                                                                        "counter-clockwise"};
/// Returns the name in files.
[[nodiscard]] constexpr std::string_view to_string(ColumnDirection direction) {
  return column_direction_names[direction == ColumnDirection::clockwise ? 0 : 1];
}
/// Returns +1 if azimuths grow with the columns or the image angle, else -1.
[[nodiscard]] constexpr double azimuth_sign(ColumnDirection direction) {
  return direction == ColumnDirection::counter_clockwise ? 1.0 : -1.0;
}

/// Calibration of an omnidirectional camera: the mapping between pixels and directions in the robot
/// frame. The axis of a mirror is vertical. `validate(const Camera&)` checks the invariant; the
/// functions below require a valid camera.
struct Camera {
  /// A pixel that sees a direction, and its weight in a blended panorama.
  struct WeightedPixel {
    PixelPoint pixel;     ///< where the direction is seen
    double weight = 1.0;  ///< shares of the lenses that see a direction; they add up to 1
  };

  CameraModel model;     ///< mapping between directions (or elevations) and image positions
  ImageSize image_size;  ///< of every picture of this camera, in pixels
  // Mirror cameras and lenses with a vertical axis (`has_vertical_axis`). Radii are those of the
  // ideal image, which is symmetric about the centre:
  PixelPoint centre;             ///< inside the image; also that of a pinhole lens
  double rim_radius_px = 0.0;    ///< nothing is seen beyond; pinhole: only if it is distorted
  double inner_radius_px = 0.0;  ///< nothing is visible within (the camera's own reflection)
  /// Sense of rotation of azimuth in the displayed picture (u right, v down). Equirectangular:
  /// clockwise means that columns from left to right follow a right turn; most 360 degree pictures
  /// do. A camera that looks up, at a mirror or through a fisheye lens, sees the world from below:
  /// clockwise, unless its driver mirrors the picture. Dual fisheye: clockwise means that the
  /// lenses' pictures are not mirrored.
  ColumnDirection direction = ColumnDirection::clockwise;
  /// Mirror: angle of the robot's forward direction in the displayed image, counter-clockwise from
  /// +u.
  double forward_angle_rad = 0.0;
  /// Equirectangular: position of the forward direction as a fraction of the width from the left
  /// edge, 0 to 1.
  double forward_column = 0.5;
  /// Map from the ideal image to the picture, for pixels that are not square or a tilted sensor: c,
  /// d, e of OCamCalib. Offsets from the centre: right + e down, and c down + d right.
  std::array<double, 3> affine{1.0, 0.0, 0.0};
  /// Lens distortion of a unified or pinhole model, before `affine`: k1, k2, p1, p2, k3 of OpenCV,
  /// for offsets from the centre divided by the focal length.
  std::array<double, 5> distortion{};
  /// True if the elevations of the pixels were assumed, not measured, as the mirror's shape is
  /// unknown. Lengths from the image of the ground would be wrong by an unknown factor.
  bool has_assumed_elevations = false;
  friend bool operator==(const Camera&, const Camera&) = default;
};

/// Throws ContractError that names the field, its value and its range.
void validate(const Camera& camera);

/// Projects a direction in the robot frame; nullopt if it falls outside the image, outside inner
/// radius to rim or outside the model's domain, or if the direction is zero or not finite. Borders
/// belong to the domain; points beyond them by at most 1e-9 of the image's size (rounding) are
/// clamped. u of an equirectangular picture is in [0, width). Cost: about ten arithmetic and four
/// trigonometric operations; for a polynomial model about ten evaluations of it in addition.
[[nodiscard]] std::optional<PixelPoint> project(const Camera& camera, const Direction3& direction);

/// Projects a direction of the lens frame of a pinhole camera (`find_rotation`), as `project`: for
/// many directions whose rotation was computed once.
[[nodiscard]] std::optional<PixelPoint> project_from_lens(const Camera& camera,
                                                          const PinholeModel& model,
                                                          const Direction3& in_lens);

/// Returns the unit direction that an image point shows; nullopt outside the domain of `project`.
[[nodiscard]] std::optional<Direction3> unproject(const Camera& camera, PixelPoint pixel);

/// Projects into each lens of a dual fisheye camera, with blending weights (`blend_share`); the
/// second entry is empty for any other camera. `project` returns the pixel with the larger weight.
[[nodiscard]] std::array<std::optional<Camera::WeightedPixel>, 2> project_all(
    const Camera& camera, const Direction3& direction);
/// Number of lenses: 2 of a dual fisheye camera, 1 of any other.
[[nodiscard]] inline int lens_count(const Camera& camera) {
  return std::holds_alternative<DualFisheyeModel>(camera.model) ? 2 : 1;
}
/// True for mirrors and lenses whose axis is vertical, so that azimuths are image angles: all
/// models but equirectangular, dual fisheye, pinhole and rig.
[[nodiscard]] bool has_vertical_axis(const Camera& camera);
/// Returns the index of the lens of a dual fisheye camera in whose half of the image a point is; 0
/// for any other camera.
[[nodiscard]] inline int lens_at(const Camera& camera, PixelPoint pixel) {
  return lens_count(camera) == 2 && pixel.u_px >= 0.5 * camera.image_size.width ? 1 : 0;
}

/// True for cameras whose pictures may be narrow ones (`PictureKind::pinhole`): pinhole and rig.
[[nodiscard]] bool has_pinhole_lenses(const Camera& camera);
/// False for a pinhole camera and for a rig whose cameras leave out a part of the horizon.
[[nodiscard]] bool shows_all_azimuths(const Camera& camera);

/// Returns the angle between the outermost columns in which a pinhole camera shows anything at the
/// height of its centre; of a rig, the azimuth at which its cameras show the horizon, in steps of
/// one degree; 0 for any other camera.
[[nodiscard]] double field_of_view(const Camera& camera);

/// The part of the picture that a mirror or a lens covers.
struct ImageCircle {
  PixelPoint centre;             ///< in the picture
  double inner_radius_px = 0.0;  ///< nothing is seen within; 0 for a lens
  double rim_radius_px = 0.0;    ///< nothing is seen beyond
};
/// Returns the circle around the mirror, or of lens `lens` of a dual fisheye camera; all zero for
/// an equirectangular or pinhole camera and a rig.
[[nodiscard]] ImageCircle image_circle(const Camera& camera, int lens);

/// A band of elevations, in radians.
struct ElevationBand {
  double bottom_rad = 0.0;  ///< lowest, in [-pi/2, pi/2]
  double top_rad = 0.0;     ///< highest, above `bottom_rad`
  friend bool operator==(const ElevationBand&, const ElevationBand&) = default;
};
/// Finds the band of elevations visible at every azimuth. Where the image frame cuts the mirror,
/// the band ends at the cut. For a dual fisheye camera and a rig: the band around the horizon, in
/// steps of one degree. Throws ContractError when no elevation is seen at every azimuth (a pinhole
/// lens, a frame that cuts even the inner radius, or a gap between lenses at the horizon).
[[nodiscard]] ElevationBand visible_elevations(const Camera& camera);

}  // namespace panonav
