#pragma once

namespace panonav {

/// Elevation is linear in the distance from the centre: `elevation_at_inner_rad` on the camera's
/// inner radius, `elevation_at_rim_rad` on its rim. Approximates a mirror of unknown shape. Valid
/// between the two elevations, either of which may be the higher one.
struct EquiangularModel {
  double elevation_at_inner_rad = 0.0;  ///< in [-pi/2, pi/2]
  double elevation_at_rim_rad = 0.0;    ///< in [-pi/2, pi/2], other than at the inner radius
  friend bool operator==(const EquiangularModel&, const EquiangularModel&) = default;
};

/// Throws ContractError that names the field, its value and its range.
void validate(const EquiangularModel& model);

/// Returns the elevation (up is positive) visible at distance `radius_px` from the image centre;
/// extrapolates beyond inner radius and rim.
[[nodiscard]] double elevation_at(const EquiangularModel& model, double radius_px,
                                  double inner_radius_px, double rim_radius_px);

/// Returns the distance from the image centre at which an elevation is visible; the caller checks
/// that it is between inner radius and rim.
[[nodiscard]] double radius_at(const EquiangularModel& model, double elevation_rad,
                               double inner_radius_px, double rim_radius_px);

}  // namespace panonav
