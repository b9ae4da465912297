#include "panonav/relative_pose/fourier_homing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

void check_pair(const HomingView& home, const HomingView& current, int highest) {
  require(home.rows() == current.rows(), "rows of the current view", current.rows(),
          to_text(home.rows()) + ", as of the home view");
  const int common = std::min(home.components(), current.components());
  require(common >= 3, "components of the views", common, ">= 3");
  const int max_highest = std::min(common - 2, TurnCorrelation::max_frequencies);
  require(highest >= 0 && highest <= max_highest, "highest frequency", highest,
          "0 (all) or 1 .. " + to_text(max_highest));
}

// Returns the window that is compared, all headings without one.
HeadingWindow check_arguments(const HomingView& home, const HomingView& current,
                              const FourierHomingOptions& options,
                              const std::optional<HeadingWindow>& window) {
  validate(options);
  check_pair(home, current, options.highest);
  if (!window) return {};
  require(std::isfinite(window->middle_rad), "heading", window->middle_rad, "finite");
  require(window->half_width_rad > 0.0F && window->half_width_rad <= std::numbers::pi_v<float>,
          "within", window->half_width_rad, "> 0 and <= pi");
  require(options.turn == FourierHomingOptions::TurnEstimate::global, "turn estimate",
          static_cast<double>(options.turn), "global");
  return *window;
}

}  // namespace

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

CoefficientView view_coefficients(const HomingView& view) noexcept {
  CoefficientView coefficients{.rows = view.rows(),
                               .components = view.components(),
                               .all_cosines = view.cosines(0).data(),
                               .all_sines = view.sines(0).data()};
  if (const auto& band = view.elevations()) {
    coefficients.has_elevations = true;
    coefficients.bottom_rad = band->bottom_rad;
    coefficients.top_rad = band->top_rad;
  }
  return coefficients;
}

HomeVector home_vector(const HomingView& home, const HomingView& current,
                       const FourierHomingOptions& options,
                       const std::optional<HeadingWindow>& window) {
  const HeadingWindow compared = check_arguments(home, current, options, window);
  return find_home_vector(view_coefficients(home), view_coefficients(current), options, compared);
}

double home_vector_correlation(const HomingView& home, const HomingView& current,
                               const FourierHomingOptions& options,
                               const std::optional<HeadingWindow>& window) {
  const HeadingWindow compared = check_arguments(home, current, options, window);
  return find_correlation(view_coefficients(home), view_coefficients(current), options, compared);
}

HomeVector home_vector_unchecked(const HomingView& home, const HomingView& current,
                                 const FourierHomingOptions& options) {
  return find_home_vector(view_coefficients(home), view_coefficients(current), options);
}

double image_difference(const HomingView& home, const HomingView& current, int highest) {
  check_pair(home, current, highest);
  return find_difference(view_coefficients(home), view_coefficients(current), highest);
}

}  // namespace panonav
