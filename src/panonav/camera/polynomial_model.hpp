#pragma once

#include <optional>
#include <vector>

namespace panonav {

/// Scaramuzza's general polynomial for mirrors and fisheye lenses (Scaramuzza, Martinelli, Siegwart
/// 2006): a pixel at distance r from the centre looks along (r, f(r)) with f(r) = sum_i
/// coefficients[i] r^i, r in px; positive f(r) looks down (the mirror stands above the camera),
/// negative f(r) looks up. Valid where the elevation is strictly monotonic in r, checked for a
/// camera's inner radius to rim.
struct PolynomialModel {
  std::vector<double> coefficients;  ///< 1 to 16, finite
  friend bool operator==(const PolynomialModel&, const PolynomialModel&) = default;
};

/// Throws ContractError that names the field, its value and its range, also when the elevation is
/// not strictly monotonic over [inner_radius_px, rim_radius_px].
void validate(const PolynomialModel& model, double inner_radius_px, double rim_radius_px);

/// Elevation (up is positive) in which a point of the image `radius_px` from the centre looks.
/// Empty where `radius_px` is negative or not finite, or the direction is not defined.
[[nodiscard]] std::optional<double> elevation_at(const PolynomialModel& model, double radius_px);

/// Distance from the centre within [inner_radius_px, rim_radius_px] at which an elevation is seen;
/// empty where it is not seen there. The model must be valid over that interval. Found by bracketed
/// Newton steps: some ten evaluations of the polynomial.
[[nodiscard]] std::optional<double> radius_at(const PolynomialModel& model, double elevation_rad,
                                              double inner_radius_px, double rim_radius_px);

}  // namespace panonav
