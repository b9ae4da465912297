#include "panonav/relative_pose/home_vector.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/portable_math.hpp"

namespace panonav {

double HomeVector::length() const noexcept {
  return portable::hypot(xi, eta);
}

double HomeVector::direction_rad() const noexcept {
  return portable::atan2(eta, xi);
}

double HomeVector::direction_deviation_rad() const noexcept {
  const double square = xi * xi + eta * eta;
  if (!(square > 0.0)) return std::numbers::pi;
  const double across =
      eta * eta * covariance[0] - 2.0 * xi * eta * covariance[1] + xi * xi * covariance[4];
  return std::min(std::sqrt(std::max(0.0, across)) / square, std::numbers::pi);
}

bool HomeVector::has_direction() const noexcept {
  return xi * xi + eta * eta > covariance[0] + covariance[4];
}

FourierHomingOptions published_homing_options(int highest, int iterations) {
  return {.highest = highest,
          .iterations = iterations,
          .turn = FourierHomingOptions::TurnEstimate::sequential,
          .gradient = FourierHomingOptions::Gradient::current,
          .weights = FourierHomingOptions::Weights::equal,
          .starting_estimates = 1,
          .displacement_search = false,
          .vertical_motion = false,
          .tilt = false};
}

}  // namespace panonav
