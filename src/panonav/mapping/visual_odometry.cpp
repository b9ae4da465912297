#include "panonav/mapping/visual_odometry.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/mapping/internal/azimuth_flow.hpp"
#include "panonav/signature/compass.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav {

namespace {

// Returns options for short steps: least squares needs no displacement search there, whose grid
// would bias the lengths.
FourierHomingOptions make_vector_options(const VisualOdometryOptions& options) {
  return {.iterations = options.iterations, .displacement_search = false};
}

std::optional<VisualStep> published_step(const OdometryView& before, const OdometryView& after,
                                         const VisualOdometryOptions& options) {
  const auto reading = compass(after.signature, before.signature, options.turn_components);
  if (!reading) return std::nullopt;
  VisualStep step;
  step.length_in_views =
      dissimilarity_l2(after.signature, before.signature, options.distance_components);
  const double length_m = options.scale_m * step.length_in_views;
  const double middle_rad = 0.5 * reading->heading_rad;
  step.before_from_after = {length_m * std::cos(middle_rad), length_m * std::sin(middle_rad),
                            reading->heading_rad};
  step.correlation = reading->correlation;
  step.residual = std::clamp(1.0 - reading->correlation, 0.0, 1.0);
  return step;
}

std::optional<VisualStep> home_vector_step(const OdometryView& before, const OdometryView& after,
                                           const VisualOdometryOptions& options) {
  const HomeVector vector =
      home_vector(before.coefficients, after.coefficients, make_vector_options(options));
  if (!(vector.correlation > 0.0)) return std::nullopt;
  VisualStep step;
  Pose2 motion = inverse(Pose2{vector.xi, vector.eta, vector.heading_rad});
  if (options.nearer_side) {
    // The robot moves away from home, so the displacement is the negative home vector.
    const AzimuthFlow flow =
        refine_flow(before.coefficients, after.coefficients,
                    {.g0 = -vector.heading_rad, .a1 = -vector.eta, .b1 = vector.xi}, 1);
    const double turn = flow.turn_rad();
    // A flow that ends farther from its start has diverged.
    constexpr double max_change_rad = 0.2;
    if (std::abs(angle_difference(turn, motion.heading_rad)) < max_change_rad) {
      // The length stays that of the home vector, whose weights reject outliers.
      const double direction = flow.direction_rad() + turn;
      motion = {vector.length() * std::cos(direction), vector.length() * std::sin(direction),
                wrap_angle(turn)};
    }
  }
  step.before_from_after = {options.scale_m * motion.x_m, options.scale_m * motion.y_m,
                            motion.heading_rad};
  step.length_in_views = vector.length();
  step.correlation = vector.correlation;
  step.residual = vector.residual;
  return step;
}

}  // namespace

void visit_options(VisualOdometryOptions& options, OptionVisitor& visitor) {
  using T = VisualOdometryOptions;
  constexpr OptionTable table{
      choice<&T::rule>("method to compute the motion between two views", "published",
                       "home_vector"),
      option<&T::scale_m>("metres per unit of length of the visual odometry", above(0), 1e6),
      option<&T::camera_height_m>("height of the camera above level ground, from which lengths in "
                                  "metres are computed; 0: unknown",
                                  0, 100),
      option<&T::distance_components>("number of Fourier components from which the published rule "
                                      "computes the distance (k1); 0: all",
                                      0, 4096),
      option<&T::turn_components>("number of Fourier components from which the published rule "
                                  "computes the rotation (k2); 0: all",
                                  0, 4096),
      option<&T::iterations>("number of refinements of the home vector", 0, 20),
      option<&T::nearer_side>("correct the error of rotations that is caused by nearer objects on "
                              "one side of the path"),
      option<&T::max_residual>(
          "largest share of the views' energy that the computed step does not explain", 0, 1),
  };
  table.visit(options, visitor);
}

OdometryView::OdometryView(FourierSignature view)
    : signature(std::move(view)), coefficients(homing_view(signature)) {
  require(signature.components() >= 3, "components of a view", signature.components(), ">= 3");
}

std::optional<VisualStep> visual_step(const OdometryView& before, const OdometryView& after,
                                      const VisualOdometryOptions& options) {
  validate(options);
  auto step = options.rule == VisualOdometryOptions::Rule::published
                  ? published_step(before, after, options)
                  : home_vector_step(before, after, options);
  if (step && step->residual > options.max_residual) return std::nullopt;
  return step;
}

std::optional<double> length_scale_m(std::span<const KnownLength> steps) {
  std::vector<double> ratios;
  for (const KnownLength& step : steps) {
    require(std::isfinite(step.length_m) && step.length_m >= 0.0, "length_m", step.length_m,
            ">= 0");
    require(std::isfinite(step.length_in_views) && step.length_in_views >= 0.0, "length_in_views",
            step.length_in_views, ">= 0");
    if (step.length_m > 0.0 && step.length_in_views > 0.0) {
      ratios.push_back(step.length_m / step.length_in_views);
    }
  }
  if (ratios.empty()) return std::nullopt;
  return upper_median_in_place(std::span(ratios));
}

VisualOdometry::VisualOdometry(const VisualOdometryOptions& options) : options_(options) {
  validate(options);
  if (options.camera_height_m > 0.0) ground_.emplace(options.camera_height_m);
}

double VisualOdometry::scale_m() const {
  return ground_ ? ground_->scale_m().value_or(options_.scale_m) : options_.scale_m;
}

std::optional<VisualStep> VisualOdometry::add(OdometryView view) {
  std::optional<VisualStep> step;
  if (last_) {
    step = visual_step(*last_, view, options_);
    if (step) {
      if (ground_) ground_->correct_step(last_->coefficients, view.coefficients, *step);
      pose_ = pose_ * step->before_from_after;
    } else {
      ++breaks_;
    }
  }
  last_ = std::move(view);
  return step;
}

}  // namespace panonav
