#pragma once

namespace panonav {

/// Elevation is linear in the distance from the centre: `elevation_at_inner_rad` on the camera's
/// inner radius, `elevation_at_rim_rad` on its rim. What is left when a mirror's shape is unknown.
/// Valid between the two; either may be the higher one.
struct EquiangularModel {
  double elevation_at_inner_rad = 0.0;  ///< in [-pi/2, pi/2]
  double elevation_at_rim_rad = 0.0;    ///< in [-pi/2, pi/2], other than at the inner radius
  friend bool operator==(const EquiangularModel&, const EquiangularModel&) = default;
};

/// Throws ContractError that names the field, its value and its range.
void validate(const EquiangularModel& model);

/// Elevation (up is positive) in which a point of the image `radius_px` from the centre looks; any
/// radius.
[[nodiscard]] double elevation_at(const EquiangularModel& model, double radius_px,
                                  double inner_radius_px, double rim_radius_px);

/// Distance from the centre at which an elevation would be seen; the caller checks the range.
[[nodiscard]] double radius_at(const EquiangularModel& model, double elevation_rad,
                               double inner_radius_px, double rim_radius_px);

}  // namespace panonav
