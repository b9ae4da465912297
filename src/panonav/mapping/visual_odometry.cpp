#include "panonav/mapping/visual_odometry.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/mapping/internal/azimuth_flow.hpp"
#include "panonav/relative_pose/pair_evidence.hpp"
#include "panonav/signature/compass.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav {

namespace {

/// Residual up to which a step is not compared with chance. Of the pairs of views from two
/// buildings or scenes, at most 2 % have a smaller residual (15 pairs of scenes;
/// docs/decisions.md).
constexpr double max_unchecked_residual = 0.15;
/// Probability of a step with at most this residual.
constexpr double probability_of_small_residual = 0.98;
/// Share of steps that may turn by any angle. Walks of robots that turn at walls have up to 7 %.
constexpr double share_of_free_turns = 0.1;
constexpr double free_turn_density = share_of_free_turns / (2.0 * std::numbers::pi);  // per rad
/// Smallest mean turn that is expected: the error of a turn between two views.
constexpr double min_mean_turn_rad = 0.03;
/// Weight of the statistics of a drive after one more step: the latest 30 steps count.
constexpr double kept_weight = 1.0 - 1.0 / 30.0;
/// Number of steps over which the speed is steady.
constexpr std::size_t steps_of_speed = 15;
/// Steps that are shorter than this share of the others are no motion.
constexpr double min_share_of_motion = 0.25;
/// Number of peaks of the correlation from which a step is computed. The third or fourth is the
/// right one in some symmetric rooms, as displacement lowers its correlation.
constexpr int tried_headings = 4;
/// Smallest probability of a step that passes over views. A wrong step does more harm to a map than
/// a gap (chosen).
constexpr double min_probability_of_long_step = 0.9;

// Returns options for short steps: least squares needs no displacement search there, whose grid
// would bias the lengths.
FourierHomingOptions make_vector_options(const VisualOdometryOptions& options) {
  return {.iterations = options.iterations,
          .starting_estimates = tried_headings,
          .displacement_search = false};
}

/// Returns the more probable one of the best home vector and the best one with another turn.
HomeVector choose_vector(const HomingView& before, const HomingView& after,
                         const FourierHomingOptions& options, const MotionPrior& prior) {
  const HomeVector first = home_vector(before, after, options);
  if (!prior.mean_turn_rad) return first;
  const auto second = find_second_vector(before, after, first, options);
  const auto log_posterior = [&](const HomeVector& vector) {
    return vector.log_likelihood() + prior.log_density(vector.heading_rad);
  };
  return second && log_posterior(*second) > log_posterior(first) ? *second : first;
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
                                           const VisualOdometryOptions& options,
                                           const MotionPrior& prior) {
  const HomeVector vector =
      choose_vector(before.coefficients, after.coefficients, make_vector_options(options), prior);
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

/// Returns the step whatever its probability.
std::optional<VisualStep> compute_step(const OdometryView& before, const OdometryView& after,
                                       const VisualOdometryOptions& options,
                                       const MotionPrior& prior) {
  validate(options);
  if (options.rule == VisualOdometryOptions::Rule::published) {
    auto step = published_step(before, after, options);
    if (step && step->residual > options.max_residual) return std::nullopt;
    return step;
  }
  auto step = home_vector_step(before, after, options, prior);
  if (!step || step->residual > options.max_residual) return std::nullopt;
  if (!(options.min_probability > 0.0)) return step;
  step->probability = probability_of_small_residual;
  if (step->residual > max_unchecked_residual) {
    step->probability = prior.posterior(
        compute_pair_features(before.coefficients, after.coefficients).direction_probability());
  }
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
      option<&T::steady_speed>(
          "assume that the speed changes little, so that lengths do not depend "
          "on the size of rooms"),
      option<&T::max_residual>(
          "largest share of the views' energy that the computed step does not explain", 0, 1),
      option<&T::min_probability>("smallest probability that the direction of a step is right "
                                  "within 45 degrees, if as many "
                                  "steps are known as so far",
                                  0, 1),
  };
  table.visit(options, visitor);
}

OdometryView::OdometryView(FourierSignature view)
    : signature(std::move(view)), coefficients(homing_view(signature)) {
  require(signature.components() >= 3, "components of a view", signature.components(), ">= 3");
}

double MotionPrior::log_density(double turn_rad) const {
  return std::log(free_turn_density / (1.0 - share_along(turn_rad)));
}

double MotionPrior::share_along(double turn_rad) const {
  const double mean_rad = mean_turn_rad.value_or(0.5 * std::numbers::pi);
  const double along =
      (1.0 - share_of_free_turns) * std::exp(-std::abs(turn_rad) / mean_rad) / (2.0 * mean_rad);
  return along / (along + free_turn_density);
}

double MotionPrior::posterior(double probability) const {
  const double right = share_right * probability;
  const double wrong = (1.0 - share_right) * (1.0 - probability);
  return right + wrong > 0.0 ? right / (right + wrong) : 0.0;
}

std::optional<VisualStep> visual_step(const OdometryView& before, const OdometryView& after,
                                      const VisualOdometryOptions& options,
                                      const MotionPrior& prior) {
  auto step = compute_step(before, after, options, prior);
  if (step && step->probability < options.min_probability) return std::nullopt;
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
  if (ground_) return ground_->scale_m().value_or(options_.scale_m);
  if (drive_.first_lengths.size() < steps_of_speed) return options_.scale_m;
  const auto median = [](std::vector<double> lengths) {
    return upper_median_in_place(std::span(lengths));
  };
  return options_.scale_m * median(drive_.first_lengths) / median(drive_.latest_lengths);
}

void VisualOdometry::learn_speed(double length_in_views) {
  const bool is_published = options_.rule == VisualOdometryOptions::Rule::published;
  if (is_published || ground_ || !options_.steady_speed || length_in_views <= 0.0) return;
  if (!drive_.latest_lengths.empty()) {
    std::vector<double> lengths = drive_.latest_lengths;
    const double usual = upper_median_in_place(std::span(lengths));
    if (length_in_views < min_share_of_motion * usual) return;
  }
  if (drive_.first_lengths.size() < steps_of_speed) drive_.first_lengths.push_back(length_in_views);
  if (drive_.latest_lengths.size() == steps_of_speed)
    drive_.latest_lengths.erase(drive_.latest_lengths.begin());
  drive_.latest_lengths.push_back(length_in_views);
}

MotionPrior VisualOdometry::prior(std::size_t views) const {
  // Before the first step, a turn of 30 degrees, a known and an unknown step are assumed.
  constexpr double first_turn_rad = std::numbers::pi / 6.0;
  const double mean_turn_rad = (drive_.turn_sum_rad + first_turn_rad) / (drive_.turn_weight + 1.0);
  return {.mean_turn_rad = static_cast<double>(views) * std::max(mean_turn_rad, min_mean_turn_rad),
          .share_right = (drive_.known_weight + 1.0) / (drive_.tried_weight + 2.0)};
}

void VisualOdometry::learn_turn(const VisualStep& step) {
  // Free turns say nothing of the others.
  const double turn_rad = step.before_from_after.heading_rad;
  const double share = prior(1).share_along(turn_rad);
  drive_.turn_weight = kept_weight * drive_.turn_weight + share;
  drive_.turn_sum_rad = kept_weight * drive_.turn_sum_rad + share * std::abs(turn_rad);
}

std::optional<VisualStep> VisualOdometry::add(OdometryView view) {
  std::optional<VisualStep> step;
  for (std::size_t i = latest_.size(); i-- > 0 && !step;) {
    const std::size_t views = latest_.size() - i;
    step = compute_step(latest_[i].view, view, options_, prior(views));
    if (views == 1) {
      drive_.known_weight = kept_weight * drive_.known_weight + (step ? step->probability : 0.0);
      drive_.tried_weight = kept_weight * drive_.tried_weight + 1.0;
    }
    const double min_probability =
        views > 1 && options_.min_probability > 0.0
            ? std::max(options_.min_probability, min_probability_of_long_step)
            : options_.min_probability;
    if (step && step->probability < min_probability) step.reset();
    if (!step) continue;
    step->views = static_cast<int>(views);
    if (views == 1) {
      learn_turn(*step);
      learn_speed(step->length_in_views);
    }
    const double factor = ground_ ? 1.0 : scale_m() / options_.scale_m;
    step->before_from_after.x_m *= factor;
    step->before_from_after.y_m *= factor;
    if (ground_) ground_->correct_step(latest_[i].view.coefficients, view.coefficients, *step);
    pose_ = latest_[i].pose * step->before_from_after;
  }
  if (!latest_.empty()) ++tried_steps_;
  if (!step && !latest_.empty()) ++breaks_;
  if (latest_.size() == max_tried_views) latest_.erase(latest_.begin());
  latest_.push_back({std::move(view), pose_});
  return step;
}

void VisualOdometry::set_scale_m(double scale_m) {
  options_.scale_m = scale_m;
  validate(options_);
}

void VisualOdometry::begin_path() {
  latest_.clear();
  drive_ = {};
}

void VisualOdometry::restart(std::optional<OdometryView> view) {
  latest_.clear();
  if (view) latest_.push_back({std::move(*view), pose_});
}

}  // namespace panonav
