#include "panonav/geometry/angles.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace panonav {

double wrap_angle_by_remainder(double angle_rad) {
  constexpr double turn = 2.0 * std::numbers::pi;
  double wrapped = std::remainder(angle_rad, turn);  // [-pi, pi]
  if (wrapped >= std::numbers::pi) wrapped = -std::numbers::pi;
  return wrapped < -std::numbers::pi ? -std::numbers::pi : wrapped;
}

double angle_difference(double to_rad, double from_rad) {
  return wrap_angle(to_rad - from_rad);
}

std::optional<CircularMean> circular_mean(std::span<const double> angles_rad) {
  if (angles_rad.empty()) return std::nullopt;
  double x = 0.0;
  double y = 0.0;
  for (const double angle : angles_rad) {
    x += std::cos(angle);
    y += std::sin(angle);
  }
  const double length = std::hypot(x, y) / static_cast<double>(angles_rad.size());
  // Angles with a shorter resultant cancel; its direction would be rounding noise.
  if (!(length > 1e-12)) return std::nullopt;
  return CircularMean{wrap_angle(std::atan2(y, x)), std::min(1.0, length)};
}

double circular_standard_deviation(const CircularMean& mean) {
  return std::sqrt(std::max(0.0, -2.0 * std::log(mean.resultant_length)));
}

}  // namespace panonav
