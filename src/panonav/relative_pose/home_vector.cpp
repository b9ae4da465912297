#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

double HomeVector::length() const noexcept {
  return std::hypot(xi, eta);
}

double HomeVector::direction_rad() const noexcept {
  return std::atan2(eta, xi);
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

void visit_options(FourierHomingOptions& options, OptionVisitor& visitor) {
  using T = FourierHomingOptions;
  constexpr OptionTable table{
      option<&T::highest>("highest compared frequency; 0: all", 0, 62),
      option<&T::iterations>("number of refinements of the solution", 0, 20),
      option<&T::rising>("compare higher frequencies with each iteration"),
      choice<&T::turn>("method for the first estimate of the heading", "sequential", "global"),
      choice<&T::gradient>("views whose gradients are used", "current", "both"),
      choice<&T::weights>("weights of components and rows", "equal", "coherence"),
      option<&T::starting_estimates>("number of headings with which the solution is started", 1,
                                     static_cast<double>(max_starting_estimates)),
      option<&T::displacement_search>(
          "first test displacements up to two thirds of R, the typical distance of objects"),
      option<&T::vertical_motion>(
          "also model the vertical motion of rows above and below the horizon"),
      option<&T::tilt>("allow a small tilt of the robot"),
  };
  table.visit(options, visitor);
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
