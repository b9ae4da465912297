#pragma once

#include <optional>

namespace panonav {

/// Hyperboloidal mirror with a single viewpoint above a perspective camera [Y03 eq. 1-4,
/// corrected]. The mirror is the sheet Z > 0 of (X^2 + Y^2) / a^2 - Z^2 / b^2 = -1; its focus (0,
/// 0, c) with c^2 = a^2 + b^2 is the viewpoint; the camera is at the other focus (0, 0, -c) and
/// looks up. Only the ratio of a and b affects the image. Valid: distances from the centre in [0,
/// focal_length_px * a / b), elevations in [-pi/2, atan(b / a)).
struct HyperboloidalModel {
  double a_mm = 28.095;            ///< above 0
  double b_mm = 23.4125;           ///< above 0
  double focal_length_px = 500.0;  ///< above 0, of the perspective camera
  friend bool operator==(const HyperboloidalModel&, const HyperboloidalModel&) = default;
};

/// Throws ContractError that names the field, its value and its range.
void validate(const HyperboloidalModel& model);

/// Returns the elevation (up is positive) visible at distance `radius_px` from the image centre
/// [Y03 eq. 3 with gamma = atan(f / r), the angle between the camera's ray and the image plane];
/// nullopt outside the valid domain.
[[nodiscard]] std::optional<double> elevation_at(const HyperboloidalModel& model, double radius_px);

/// Returns the distance from the image centre at which an elevation is visible, the inverse of
/// `elevation_at`. For the horizon this is [Y03 eq. 4] for a distant point: a^2 f / (2 b c).
/// nullopt outside the valid domain.
[[nodiscard]] std::optional<double> radius_at(const HyperboloidalModel& model,
                                              double elevation_rad);

}  // namespace panonav
