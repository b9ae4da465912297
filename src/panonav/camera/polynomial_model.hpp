#pragma once

#include <functional>
#include <optional>
#include <vector>

namespace panonav {

/// Scaramuzza's general polynomial for mirrors and fisheye lenses (Scaramuzza, Martinelli, Siegwart
/// 2006): a pixel at distance r from the centre looks along (r, f(r)) with f(r) = sum_i
/// coefficients[i] r^i, r in px; positive f(r) looks down (the mirror stands above the camera),
/// negative f(r) looks up. Valid if the elevation is strictly monotonic in r between a camera's
/// inner radius and rim.
struct PolynomialModel {
  std::vector<double> coefficients;  ///< 1 to 16, finite
  friend bool operator==(const PolynomialModel&, const PolynomialModel&) = default;
};

/// Throws ContractError that names the field, its value and its range, also when the elevation is
/// not strictly monotonic over [inner_radius_px, rim_radius_px].
void validate(const PolynomialModel& model, double inner_radius_px, double rim_radius_px);

/// Returns the elevation (up is positive) visible at distance `radius_px` from the image centre;
/// nullopt if `radius_px` is negative or not finite, or the elevation is undefined.
[[nodiscard]] std::optional<double> elevation_at(const PolynomialModel& model, double radius_px);

/// Returns the distance from the image centre within [inner_radius_px, rim_radius_px] at which an
/// elevation is visible, or nullopt. The model must be valid over that interval. Cost: about ten
/// evaluations of the polynomial (bracketed Newton steps).
[[nodiscard]] std::optional<double> radius_at(const PolynomialModel& model, double elevation_rad,
                                              double inner_radius_px, double rim_radius_px);

/// A polynomial fitted to another model, and how much they differ.
struct PolynomialFit {
  PolynomialModel model;      ///< of 16 coefficients
  double residual_rad = 0.0;  ///< largest difference of elevations up to the rim
};

/// Fits a polynomial to the elevations that `elevation_at` returns for distances from the centre in
/// (0, rim_radius_px], by least squares of angles. The result need not be valid.
[[nodiscard]] PolynomialFit fit_polynomial(const std::function<double(double)>& elevation_at,
                                           double rim_radius_px);

}  // namespace panonav
