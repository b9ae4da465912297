#include "panonav/camera/unified_model.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/core/error.hpp"

namespace panonav {

void validate(const UnifiedModel& model) {
  require(std::isfinite(model.xi) && model.xi >= 0, "xi", model.xi, "finite and at least 0");
  require(std::isfinite(model.focal_length_px) && model.focal_length_px > 0, "focal_length_px",
          model.focal_length_px, "finite and above 0");
}

std::optional<double> elevation_at(const UnifiedModel& model, double radius_px) {
  if (!(radius_px >= 0) || !std::isfinite(radius_px)) return std::nullopt;
  const double m = radius_px / model.focal_length_px;
  const double discriminant = 1 + (1 - model.xi * model.xi) * m * m;
  if (!(discriminant > 0)) return std::nullopt;
  const double eta = (model.xi + std::sqrt(discriminant)) / (m * m + 1);
  const double psi = std::atan2(eta * m, eta - model.xi);
  const double below_horizon = psi - std::numbers::pi / 2;
  return model.axis == UnifiedModel::Axis::down ? below_horizon : -below_horizon;
}

std::optional<double> radius_at(const UnifiedModel& model, double elevation_rad) {
  if (!(std::abs(elevation_rad) <= std::numbers::pi / 2)) return std::nullopt;
  // Along the axis: cos(psi); across it: sin(psi).
  const double along =
      model.axis == UnifiedModel::Axis::down ? -std::sin(elevation_rad) : std::sin(elevation_rad);
  const double across = std::max(0.0, std::cos(elevation_rad));
  const double min_along = model.xi <= 1 ? -model.xi : -1 / model.xi;
  if (!(along > min_along)) return std::nullopt;
  return model.focal_length_px * across / (model.xi + along);
}

namespace {

/// Fits focal length and distortion for one xi; nullopt if its domain does not contain the angles.
std::optional<UnifiedFit> fit_with_xi(double xi, std::span<const double> angles_rad,
                                      std::span<const double> radii_px) {
  const auto count = static_cast<Eigen::Index>(angles_rad.size());
  Eigen::MatrixXd matrix(count, 3);
  Eigen::VectorXd right(count);
  Eigen::VectorXd slope(count);  // of the angle by the radius
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double along = std::cos(angles_rad[at]);
    if (!(along > (xi <= 1 ? -xi : -1 / xi) + 1e-6)) return std::nullopt;
    const std::size_t low = at == 0 ? 0 : at - 1;
    const std::size_t high = std::min(at + 1, angles_rad.size() - 1);
    slope(i) = (angles_rad[high] - angles_rad[low]) / (radii_px[high] - radii_px[low]);
    const double m = std::sin(angles_rad[at]) / (xi + along);
    for (Eigen::Index k = 0; k < 3; ++k) {
      matrix(i, k) = slope(i) * std::pow(m, static_cast<double>(2 * k + 1));
    }
    right(i) = slope(i) * radii_px[at];
  }
  const Eigen::Vector3d solved = matrix.colPivHouseholderQr().solve(right);
  if (!(solved(0) > 0)) return std::nullopt;
  UnifiedFit fit;
  fit.model = {xi, solved(0)};
  fit.k = {solved(1) / solved(0), solved(2) / solved(0)};
  fit.residual_rad = (matrix * solved - right).cwiseAbs().maxCoeff();
  // The distorted radius must grow with the angle.
  const Eigen::VectorXd radius = (matrix * solved).cwiseQuotient(slope);
  for (Eigen::Index i = 1; i < count; ++i) {
    if (!(radius(i) > radius(i - 1))) return std::nullopt;
  }
  return fit;
}

}  // namespace

UnifiedFit fit_unified(std::span<const double> angles_rad, std::span<const double> radii_px) {
  require(angles_rad.size() >= 8 && angles_rad.size() == radii_px.size(), "number of angles",
          static_cast<double>(angles_rad.size()), "the number of radii, at least 8");
  constexpr double max_xi = 4.0;
  UnifiedFit best;
  best.residual_rad = std::numeric_limits<double>::infinity();
  double low = 0.0;
  double high = max_xi;
  for (int round = 0; round < 5; ++round) {
    constexpr int grid = 40;
    const double step = (high - low) / grid;
    for (int i = 0; i <= grid; ++i) {
      const auto fit = fit_with_xi(low + step * i, angles_rad, radii_px);
      if (fit && fit->residual_rad < best.residual_rad) best = *fit;
    }
    low = std::max(0.0, best.model.xi - step);
    high = best.model.xi + step;
  }
  return best;
}

}  // namespace panonav
