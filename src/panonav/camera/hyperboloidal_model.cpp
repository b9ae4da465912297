#include "panonav/camera/hyperboloidal_model.hpp"

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"

namespace panonav {

void validate(const HyperboloidalModel& model) {
  const auto positive = [](const char* field, double value) {
    require(std::isfinite(value) && value > 0, field, value, "finite and above 0");
  };
  positive("a_mm", model.a_mm);
  positive("b_mm", model.b_mm);
  positive("focal_length_px", model.focal_length_px);
}

std::optional<double> elevation_at(const HyperboloidalModel& model, double radius_px) {
  const double a = model.a_mm;
  const double b = model.b_mm;
  const double f = model.focal_length_px;
  // At radii of f a / b or more the camera's ray does not meet the mirror: it is at least as
  // flat as the asymptotes.
  if (!(radius_px >= 0) || !(radius_px * b < f * a)) return std::nullopt;
  const double c = std::hypot(a, b);
  // [Y03 eq. 3] with numerator and denominator multiplied by hypot(r, f), and both negated, so that
  // the straight view down (r = 0) needs no special case.
  return std::atan2(2 * b * c * std::hypot(radius_px, f) - (b * b + c * c) * f, a * a * radius_px);
}

std::optional<double> radius_at(const HyperboloidalModel& model, double elevation_rad) {
  const double a = model.a_mm;
  const double b = model.b_mm;
  const double c = std::hypot(a, b);
  const double sine = std::sin(elevation_rad);
  if (!(elevation_rad >= -std::numbers::pi / 2 && elevation_rad < std::atan2(b, a))) {
    return std::nullopt;
  }
  // The mirror in polar form about its focus is rho = a^2 / (b - c sin(elevation)); the camera's
  // ray to that point has the slope rho cos(elevation) / (2 c + rho sin(elevation)).
  const double cosine = std::max(0.0, std::cos(elevation_rad));
  return model.focal_length_px * a * a * cosine / (2 * b * c - (b * b + c * c) * sine);
}

}  // namespace panonav
