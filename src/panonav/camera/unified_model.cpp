#include "panonav/camera/unified_model.hpp"

#include <algorithm>
#include <cmath>
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

}  // namespace panonav
