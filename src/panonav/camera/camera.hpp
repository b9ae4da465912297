#pragma once

#include <array>
#include <optional>
#include <variant>

#include "panonav/camera/dual_fisheye_model.hpp"
#include "panonav/camera/equiangular_model.hpp"
#include "panonav/camera/hyperboloidal_model.hpp"
#include "panonav/camera/polynomial_model.hpp"
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
/// linear. The width is one full turn. Valid: elevations from bottom to top.
struct EquirectangularModel {
  double elevation_bottom_rad = -1.5707963267948966;  ///< of the picture's lower edge
  double elevation_top_rad = 1.5707963267948966;      ///< of the picture's upper edge
  friend bool operator==(const EquirectangularModel&, const EquirectangularModel&) = default;
};

/// One of the projection models, each defined in its own header. This is the only list of them.
using CameraModel = std::variant<HyperboloidalModel, PolynomialModel, UnifiedModel,
                                 EquiangularModel, EquirectangularModel, DualFisheyeModel>;

/// Sense in which azimuths run in a picture; for its columns, see `Camera::direction`.
enum class ColumnDirection {
  clockwise,         ///< azimuths grow against the columns or the image angle
  counter_clockwise  ///< azimuths grow with them
};

/// A camera that sees all azimuths: how its pixels and the directions in the robot frame belong
/// together. The axis of a mirror is vertical. Invariant checked by `validate(const Camera&)`; the
/// functions below expect a valid camera.
struct Camera {
  /// A pixel that sees a direction, and its weight in a blended panorama.
  struct WeightedPixel {
    PixelPoint pixel;     ///< where the direction is seen
    double weight = 1.0;  ///< shares of the lenses that see a direction; they add up to 1
  };

  CameraModel model;     ///< how elevation, or direction, and place in the picture belong together
  ImageSize image_size;  ///< of every picture of this camera, in pixels
  // Mirror cameras (all models but equirectangular and dual fisheye):
  PixelPoint centre;             ///< inside the image
  double rim_radius_px = 0.0;    ///< nothing is seen beyond
  double inner_radius_px = 0.0;  ///< nothing is seen within (the camera's own reflection)
  /// Sense in which azimuth runs in the picture as it is shown (u right, v down). Equirectangular:
  /// clockwise means that the columns, left to right, follow a turn to the right seen from above. A
  /// camera that looks up, at a mirror or through a fisheye lens, sees the world from below:
  /// clockwise, unless its driver mirrors the picture. So do most 360 degree pictures. Dual
  /// fisheye: clockwise means that right in a lens's picture is right in the world, and not
  /// mirrored.
  ColumnDirection direction = ColumnDirection::clockwise;
  /// Mirror: image angle of the robot's forward direction, counter-clockwise as shown, from +u.
  double forward_angle_rad = 0.0;
  /// Equirectangular: fraction of the width, between its outer edges, that looks along the heading;
  /// 0 to 1.
  double forward_column = 0.5;
  friend bool operator==(const Camera&, const Camera&) = default;
};

/// Throws ContractError that names the field, its value and its range.
void validate(const Camera& camera);

/// Projects a direction in the robot frame; nullopt where the camera does not see it: outside the
/// image, outside inner radius to rim, outside the model's domain, or for a direction without
/// length or with values that are not finite. Borders belong to the domain; rounding up to 1e-9 of
/// the image's size beyond them is forgiven and clamped. u of an equirectangular picture is in [0,
/// width). Cost: some ten arithmetic and four trigonometric operations; polynomials ten evaluations
/// more.
[[nodiscard]] std::optional<PixelPoint> project(const Camera& camera, const Direction3& direction);

/// Returns the unit direction that a point of the image shows; nullopt outside the same domain.
[[nodiscard]] std::optional<Direction3> unproject(const Camera& camera, PixelPoint pixel);

/// Projects into each lens: two of a dual fisheye camera, in order, one of any other (the second is
/// empty). `project` returns the one of the larger weight. See `blend_share`.
[[nodiscard]] std::array<std::optional<Camera::WeightedPixel>, 2> project_all(
    const Camera& camera, const Direction3& direction);
/// Number of lenses: 2 of a dual fisheye camera, 1 of any other.
[[nodiscard]] inline int lens_count(const Camera& camera) {
  return std::holds_alternative<DualFisheyeModel>(camera.model) ? 2 : 1;
}
/// Returns the index of the lens of a dual fisheye camera in whose half of the image a point is; 0
/// for any other camera.
[[nodiscard]] inline int lens_at(const Camera& camera, PixelPoint pixel) {
  return lens_count(camera) == 2 && pixel.u_px >= 0.5 * camera.image_size.width ? 1 : 0;
}

/// The part of the picture that a mirror or a lens covers.
struct ImageCircle {
  PixelPoint centre;             ///< in the picture
  double inner_radius_px = 0.0;  ///< nothing is seen within; 0 for a lens
  double rim_radius_px = 0.0;    ///< nothing is seen beyond
};
/// Returns the circle of the mirror, or of that lens of a dual fisheye camera; all zero for an
/// equirectangular one.
[[nodiscard]] ImageCircle image_circle(const Camera& camera, int lens);

/// A band of elevations, in radians.
struct ElevationBand {
  double bottom_rad = 0.0;  ///< lowest, in [-pi/2, pi/2]
  double top_rad = 0.0;     ///< highest, above `bottom_rad`
  friend bool operator==(const ElevationBand&, const ElevationBand&) = default;
};
/// Finds the band that is seen at every azimuth. Where the frame cuts the mirror, the band ends
/// where the cut begins. Of a dual fisheye camera: the band about the horizon, to a degree (its
/// lenses see the whole sphere where nothing is cut).
/// Throws ContractError when no elevation is seen at every azimuth (the frame cuts even the inner
/// radius, or lenses leave a gap at the horizon).
[[nodiscard]] ElevationBand visible_elevations(const Camera& camera);

}  // namespace panonav
