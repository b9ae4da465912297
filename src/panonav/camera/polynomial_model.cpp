#include "panonav/camera/polynomial_model.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

#include "panonav/core/error.hpp"

namespace panonav {
namespace {

double evaluate(std::span<const double> coefficients, double x) {
  double value = 0;
  for (std::size_t i = coefficients.size(); i-- > 0;) value = value * x + coefficients[i];
  return value;
}

std::vector<double> differentiate(std::span<const double> coefficients) {
  std::vector<double> result;
  for (std::size_t i = 1; i < coefficients.size(); ++i) {
    result.push_back(static_cast<double>(i) * coefficients[i]);
  }
  return result;
}

double find_root_by_bisection(std::span<const double> coefficients, double low, double high) {
  const bool low_is_negative = evaluate(coefficients, low) < 0;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    ((evaluate(coefficients, middle) < 0) == low_is_negative ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Returns the roots in (low, high) at which the polynomial changes its sign, ascending. Between
/// neighbouring roots of the derivative the polynomial is monotonic, so each of these intervals
/// holds at most one.
std::vector<double> find_sign_changes(std::span<const double> coefficients, double low,
                                      double high) {
  if (coefficients.size() < 2) return {};
  std::vector<double> borders = find_sign_changes(differentiate(coefficients), low, high);
  borders.insert(borders.begin(), low);
  borders.push_back(high);
  std::vector<double> result;
  for (std::size_t i = 0; i + 1 < borders.size(); ++i) {
    const double left = evaluate(coefficients, borders[i]);
    const double right = evaluate(coefficients, borders[i + 1]);
    if ((left < 0 && right > 0) || (left > 0 && right < 0)) {
      result.push_back(find_root_by_bisection(coefficients, borders[i], borders[i + 1]));
    }
  }
  return result;
}

}  // namespace

void validate(const PolynomialModel& model, double inner_radius_px, double rim_radius_px) {
  const std::vector<double>& c = model.coefficients;
  require(!c.empty() && c.size() <= 16, "number of coefficients", static_cast<double>(c.size()),
          "1 to 16");
  for (const double value : c) require(std::isfinite(value), "coefficients", value, "finite");
  // The elevation atan2(-f(r), r) has the slope (f - r f') / (r^2 + f^2); f - r f' = sum (1 - i)
  // c_i r^i.
  std::vector<double> slope(c.size());
  for (std::size_t i = 0; i < c.size(); ++i) slope[i] = (1.0 - static_cast<double>(i)) * c[i];
  std::vector<double> checked_radii_px =
      find_sign_changes(differentiate(slope), inner_radius_px, rim_radius_px);
  checked_radii_px.push_back(inner_radius_px);
  checked_radii_px.push_back(rim_radius_px);
  const double at_inner = evaluate(slope, inner_radius_px);
  for (const double radius_px : checked_radii_px) {
    if (!(evaluate(slope, radius_px) * at_inner > 0)) {
      throw ContractError("coefficients: radius where the elevation stops rising or falling",
                          radius_px, "outside inner_radius_px .. rim_radius_px");
    }
  }
}

std::optional<double> elevation_at(const PolynomialModel& model, double radius_px) {
  if (!(radius_px >= 0) || !std::isfinite(radius_px)) return std::nullopt;
  const double f = evaluate(model.coefficients, radius_px);
  if (!std::isfinite(f) || (f == 0 && radius_px == 0)) return std::nullopt;
  return std::atan2(-f, radius_px);
}

std::optional<double> radius_at(const PolynomialModel& model, double elevation_rad,
                                double inner_radius_px, double rim_radius_px) {
  // The ray (r, -f(r)) and the direction (cos, sin) are parallel where their cross product is 0.
  const double cosine = std::cos(elevation_rad);
  const double sine = std::sin(elevation_rad);
  const std::vector<double> slope = differentiate(model.coefficients);
  const auto cross = [&](double r) { return r * sine + evaluate(model.coefficients, r) * cosine; };
  double low = inner_radius_px;
  double high = rim_radius_px;
  const double at_low = cross(low);
  const double at_high = cross(high);
  if (!std::isfinite(at_low) || !std::isfinite(at_high)) return std::nullopt;
  if (at_low == 0) return low;
  if (at_high == 0) return high;
  if ((at_low < 0) == (at_high < 0)) return std::nullopt;
  double r = low + (high - low) * (at_low / (at_low - at_high));
  for (int i = 0; i < 100; ++i) {
    const double value = cross(r);
    if (value == 0) return r;
    ((value < 0) == (at_low < 0) ? low : high) = r;
    double next = r - value / (sine + evaluate(slope, r) * cosine);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - r) <= 1e-13 * rim_radius_px) return next;
    r = next;
  }
  return r;
}

PolynomialFit fit_polynomial(const std::function<double(double)>& elevation_at,
                             double rim_radius_px) {
  constexpr Eigen::Index coefficients = 16;
  constexpr Eigen::Index samples = 400;
  constexpr int checks = 1000;
  // A direction of elevation e at the radius r errs by sin e cos e + f(r) cos^2 e / r, which is
  // linear in the coefficients of f. Samples are denser near the rim, where polynomials err most.
  Eigen::MatrixXd matrix(samples, coefficients);
  Eigen::VectorXd right(samples);
  for (Eigen::Index i = 0; i < samples; ++i) {
    const double share =
        std::sin(0.5 * std::numbers::pi * (static_cast<double>(i) + 0.5) / samples);
    const double e = elevation_at(share * rim_radius_px);
    const double weight = std::cos(e) * std::cos(e) / share;
    for (Eigen::Index k = 0; k < coefficients; ++k) {
      matrix(i, k) = weight * std::pow(share, static_cast<double>(k));
    }
    right(i) = -std::sin(e) * std::cos(e);
  }
  const Eigen::VectorXd solved = matrix.colPivHouseholderQr().solve(right);
  PolynomialFit fit;
  for (Eigen::Index k = 0; k < coefficients; ++k) {
    fit.model.coefficients.push_back(solved(k) *
                                     std::pow(rim_radius_px, 1.0 - static_cast<double>(k)));
  }
  for (int i = 1; i <= checks; ++i) {
    const double radius_px = rim_radius_px * i / checks;
    const auto fitted = panonav::elevation_at(fit.model, radius_px);
    const double residual = fitted ? std::abs(*fitted - elevation_at(radius_px)) : std::numbers::pi;
    fit.residual_rad = std::max(fit.residual_rad, residual);
  }
  return fit;
}

}  // namespace panonav
