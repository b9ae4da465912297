#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// A point of the continuous image plane; the centre of pixel (u, v) lies at (u + 0.5, v + 0.5).
struct PixelPoint {
  double u_px = 0.0;
  double v_px = 0.0;
  friend bool operator==(const PixelPoint&, const PixelPoint&) = default;
};

/// Hyperboloidal mirror with a single viewpoint above a perspective camera, X^2+Y^2 over a^2 minus
/// Z^2 over b^2 = -1, c^2 = a^2 + b^2 [Y03 eq. 1-4, corrected]. Valid: elevations that the mirror
/// reflects into the lens.
struct HyperboloidalModel {
  double a_mm = 28.095;
  double b_mm = 23.4125;
  double focal_length_px = 500.0;
  friend bool operator==(const HyperboloidalModel&, const HyperboloidalModel&) = default;
};

/// Scaramuzza's general polynomial: a pixel at distance r from the centre looks along (r, f(r))
/// with f(r) = sum_i coefficients[i] r^i; positive f(r) looks down (the mirror stands above the
/// camera).
struct PolynomialModel {
  std::vector<double> coefficients;
  friend bool operator==(const PolynomialModel&, const PolynomialModel&) = default;
};

/// Unified central model (Mei): unit sphere, then perspective from a point xi above its centre.
struct UnifiedModel {
  double xi = 1.0;
  double focal_length_px = 300.0;
  friend bool operator==(const UnifiedModel&, const UnifiedModel&) = default;
};

/// Elevation is linear in the distance from the centre: `elevation_at_inner_rad` on the inner
/// radius, `elevation_at_rim_rad` on the rim. What is left when a mirror's shape is unknown.
struct EquiangularModel {
  double elevation_at_inner_rad = 0.0;
  double elevation_at_rim_rad = 0.0;
  friend bool operator==(const EquiangularModel&, const EquiangularModel&) = default;
};

/// A 360 degree picture or a ready-made panorama: columns are azimuths, rows are elevations, both
/// linear.
struct EquirectangularModel {
  double elevation_bottom_rad = -1.5707963267948966;  ///< of the picture's lower edge
  double elevation_top_rad = 1.5707963267948966;      ///< of the picture's upper edge
  friend bool operator==(const EquirectangularModel&, const EquirectangularModel&) = default;
};

using CameraModel = std::variant<HyperboloidalModel, PolynomialModel, UnifiedModel,
                                 EquiangularModel, EquirectangularModel>;

enum class ColumnDirection { clockwise, counter_clockwise };

/// A camera that sees all azimuths: how its pixels and the directions in the robot frame belong
/// together. The mirror's axis is vertical. Invariant checked by `validate(const Camera&)`.
struct Camera {
  CameraModel model;
  ImageSize image_size;
  // Mirror cameras (all models but equirectangular):
  PixelPoint centre;
  double rim_radius_px = 0.0;    ///< nothing is seen beyond
  double inner_radius_px = 0.0;  ///< nothing is seen within (the camera's own reflection)
  /// How azimuth runs in the picture, seen as it is shown (u right, v down). A mirror image seen
  /// from below runs the other way than the world seen from above.
  ColumnDirection direction = ColumnDirection::counter_clockwise;
  /// Mirror: image angle of the robot's forward direction, counter-clockwise as shown, from +u.
  double forward_angle_rad = 0.0;
  /// Equirectangular: fraction of the width, between its outer edges, that looks along the heading.
  double forward_column = 0.5;
  friend bool operator==(const Camera&, const Camera&) = default;
};

/// Throws ContractError that names the field, its value and its range.
void validate(const Camera& camera);

/// Where a direction in the robot frame is seen; empty where the camera does not see it.
[[nodiscard]] std::optional<PixelPoint> project(const Camera& camera, const Direction3& direction);

/// The unit direction in which a point of the image looks; empty outside the valid domain.
[[nodiscard]] std::optional<Direction3> unproject(const Camera& camera, PixelPoint pixel);

/// Lowest and highest elevation that is seen at every azimuth, in radians.
struct ElevationBand {
  double bottom_rad = 0.0;
  double top_rad = 0.0;
  friend bool operator==(const ElevationBand&, const ElevationBand&) = default;
};
[[nodiscard]] ElevationBand visible_elevations(const Camera& camera);

}  // namespace panonav
