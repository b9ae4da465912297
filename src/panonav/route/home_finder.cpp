#include "panonav/route/home_finder.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/route/internal/snapshot_sight.hpp"

namespace panonav {

namespace {

using State = Eigen::Matrix<double, DriftingPose::states, 1>;
using Covariance =
    Eigen::Matrix<double, DriftingPose::states, DriftingPose::states, Eigen::RowMajor>;

// Errors of a pose by a snapshot: a part of R, as at the end of homing, and a part of the way to
// the snapshot; of the heading likewise, in rad for each R.
constexpr double fix_error_of_r = 0.05;
constexpr double fix_error_of_way = 0.3;
constexpr double fix_heading_error_rad = 0.05;
constexpr double fix_heading_error_of_way = 0.3;
// Longer home vectors, in units of R, say little: they no longer grow with the distance.
constexpr double max_fix_way_of_r = 0.4;
// Errors of poses by snapshots are alike over this way, so that more of them say no more.
constexpr double fix_spacing_m = 1.0;
// Largest squared Mahalanobis distance of a pose: 99 % of right ones [chi-squared, 3 degrees].
constexpr double max_mismatch = 11.34;
// Half of the window of headings beyond three deviations, as of `ChainPilot`.
constexpr double pose_heading_error_rad = 0.35;
// Views this far apart, as a part of R, test a hypothesis [Wald 1945, sequential probability ratio
// test]: whether the pose of the next view agrees, which half of the views in the area do, and
// elsewhere some of a hundred by chance. Nearer views show the same surroundings, such as an aisle
// among many, and agree in the same error. It counts at odds of 1000, and is dropped at odds of 1
// to 10.
constexpr double test_spacing_of_r = 0.15;
constexpr double agreeing_if_right = 0.5;
constexpr double agreeing_by_chance = 0.08;
constexpr double sure_log_odds = 6.9;
constexpr double max_log_odds = 10.0;
constexpr double wrong_log_odds = -2.3;
// Up to this deviation, as a part of R, a pose is no hypothesis, as hardly another place is near.
constexpr double sure_deviation_of_r = 0.3;
constexpr double max_way_without_fix_m = 4.0;
// A robot has arrived where its pose says so, too, up to this error and three deviations.
constexpr double arrival_error_m = 0.3;
constexpr double spiral_point_radius_m = 0.3;
constexpr int max_steps_per_point = 6;
constexpr int max_failed_ends = 6;
constexpr int max_steps_without_progress = 20;
constexpr double spiral_circle_rad = 2.0 * std::numbers::pi;

Eigen::Matrix3d measurement_covariance(double deviation_m, double deviation_rad) {
  return Eigen::Vector3d(deviation_m * deviation_m, deviation_m * deviation_m,
                         deviation_rad * deviation_rad)
      .asDiagonal();
}

SnapshotChain first_snapshot(const SnapshotChain& area) {
  SnapshotChain home(area.shape(), area.elevations());
  home.append({}, area.view(0));
  home.set_model(area.model());
  return home;
}

}  // namespace

void visit_options(HomeFinderOptions& options, OptionVisitor& visitor) {
  using T = HomeFinderOptions;
  constexpr OptionTable table{
      option<&T::max_step_m>("longest motion between two views", 0.001, 100),
      option<&T::error_factor>("radius of the search for home, in standard deviations", 1, 100),
      option<&T::drift>("drift that odometry does not see, as a part of the distance", 0, 1),
      option<&T::heading_drift_rad_per_m>("constant drift of the heading", 0, 1),
  };
  table.visit(options, visitor);
}

DriftingPose::DriftingPose(const OdometryNoise& noise, const HomeFinderOptions& options)
    : noise_(noise) {
  validate(noise_);
  validate(options);
  Eigen::Map<Covariance> covariance(covariance_.data());
  constexpr double start_m = 0.1;
  constexpr double start_rad = 0.05;
  const auto square = [](double x) { return x * x; };
  covariance(0, 0) = covariance(1, 1) = square(start_m);
  covariance(2, 2) = square(start_rad);
  covariance(3, 3) = covariance(4, 4) = 0.5 * square(options.drift);
  covariance(5, 5) = square(options.heading_drift_rad_per_m);
}

void DriftingPose::move(const Pose2& moved) {
  Eigen::Map<State> state(state_.data());
  Eigen::Map<Covariance> covariance(covariance_.data());
  const double step_m = std::hypot(moved.x_m, moved.y_m);
  const double c = std::cos(state(2));
  const double s = std::sin(state(2));
  const double dx = c * moved.x_m - s * moved.y_m;
  const double dy = s * moved.x_m + c * moved.y_m;
  state(0) += dx + step_m * state(3);
  state(1) += dy + step_m * state(4);
  state(2) = wrap_angle(state(2) + moved.heading_rad + step_m * state(5));
  Covariance step = Covariance::Identity();
  step(0, 2) = -dy;
  step(1, 2) = dx;
  step(0, 3) = step(1, 4) = step(2, 5) = step_m;
  covariance = (step * covariance * step.transpose()).eval();
  const StepSampler sampler(moved, noise_);
  const double travel_m = sampler.translation_deviation_m();
  const double turn_rad =
      std::hypot(sampler.rotation_deviation_rad(), noise_.rotation_scale_error * moved.heading_rad);
  covariance(0, 0) += travel_m * travel_m;
  covariance(1, 1) += travel_m * travel_m;
  covariance(2, 2) += turn_rad * turn_rad;
}

double DriftingPose::mismatch(const Pose2& measured, double deviation_m,
                              double deviation_rad) const {
  const Eigen::Map<const State> state(state_.data());
  const Eigen::Map<const Covariance> covariance(covariance_.data());
  const Eigen::Vector3d off(measured.x_m - state(0), measured.y_m - state(1),
                            wrap_angle(measured.heading_rad - state(2)));
  const Eigen::Matrix3d spread =
      covariance.topLeftCorner<3, 3>() + measurement_covariance(deviation_m, deviation_rad);
  return off.dot(spread.ldlt().solve(off));
}

void DriftingPose::correct(const Pose2& measured, double deviation_m, double deviation_rad) {
  Eigen::Map<State> state(state_.data());
  Eigen::Map<Covariance> covariance(covariance_.data());
  const Eigen::Vector3d off(measured.x_m - state(0), measured.y_m - state(1),
                            wrap_angle(measured.heading_rad - state(2)));
  const Eigen::Matrix3d noise = measurement_covariance(deviation_m, deviation_rad);
  const Eigen::Matrix3d spread = covariance.topLeftCorner<3, 3>() + noise;
  const Eigen::Matrix<double, states, 3> gain =
      covariance.leftCols<3>() * spread.ldlt().solve(Eigen::Matrix3d::Identity());
  state += gain * off;
  state(2) = wrap_angle(state(2));
  // Joseph's form, which stays positive definite.
  Covariance rest = Covariance::Identity();
  rest.leftCols<3>() -= gain;
  covariance = (rest * covariance * rest.transpose() + gain * noise * gain.transpose()).eval();
}

Pose2 DriftingPose::pose() const {
  return {state_[0], state_[1], state_[2]};
}

Point2 DriftingPose::drift_m_per_m() const {
  return {state_[3], state_[4]};
}

double DriftingPose::deviation_m() const {
  const Eigen::Map<const Covariance> covariance(covariance_.data());
  const double mean = 0.5 * (covariance(0, 0) + covariance(1, 1));
  return std::sqrt(mean +
                   std::hypot(0.5 * (covariance(0, 0) - covariance(1, 1)), covariance(0, 1)));
}

double DriftingPose::deviation_rad() const {
  return std::sqrt(covariance_[2 * states + 2]);
}

HomeFinder::HomeFinder(SnapshotChain area, const OdometryNoise& noise,
                       const HomeFinderOptions& options)
    : area_(std::move(area)), options_(options), by_odometry_(noise, options) {
  require(area_.snapshots() > 0, "snapshots of the home area", 0.0, ">= 1");
  for (const ChainNode& node : area_.nodes()) {
    nodes_radius_m_ = std::max(nodes_radius_m_, distance(node.position, {}));
  }
  area_radius_m_ = nodes_radius_m_ + static_cast<double>(area_.model().reach_m);
}

void HomeFinder::move(const Pose2& moved) {
  require(is_finite(moved), "motion between views", moved.x_m, "finite");
  by_odometry_.move(moved);
  const double step_m = std::hypot(moved.x_m, moved.y_m);
  since_fix_m_ += step_m;
  if (hypothesis_) {
    hypothesis_->pose.move(moved);
    hypothesis_->since_fix_m += step_m;
    hypothesis_->since_test_m += step_m;
    // The robot leaves the area before the hypothesis was confirmed.
    if (hypothesis_->log_odds < sure_log_odds && !may_be_near()) drop_hypothesis();
  }
  moved_ = moved_ * moved;
  view_.reset();
}

bool HomeFinder::may_be_near() const {
  constexpr double near_deviations = 3.0;
  return distance(estimate().pose().position(), {}) <=
         area_radius_m_ + near_deviations * estimate().deviation_m();
}

// Similar places farther away come into question only after those nearer by were searched.
double HomeFinder::likely_error_m() const {
  constexpr double likely_deviations = 1.5;  // two of three positions [Rayleigh distribution]
  return std::max(nodes_radius_m_, likely_deviations * by_odometry_.deviation_m());
}

// Returns the pose by the snapshot of the greatest confidence, of those that the estimate allows.
std::optional<HomeFinder::Fix> HomeFinder::find_fix(const DriftingPose& pose,
                                                    const HomingView& view,
                                                    double max_shift_m) const {
  const auto r_m = static_cast<double>(area_.model().typical_distance_m);
  HeadingWindow window;
  const double half_rad = pose_heading_error_rad + 3.0 * pose.deviation_rad();
  if (half_rad < std::numbers::pi) {
    window = {static_cast<float>(-pose.pose().heading_rad), static_cast<float>(half_rad)};
  }
  std::optional<Fix> fix;
  double max_confidence = -1.0;
  for (std::size_t node = 0; node < area_.nodes().size(); ++node) {
    if (!area_.nodes()[node].has_snapshot()) continue;
    const HomingView snapshot = area_.view(node);
    const SnapshotSight sight =
        look_at_snapshot(view_coefficients(snapshot), view_coefficients(view), window);
    const double confidence = usable_confidence(sight.confidence, sight.difference, area_.model());
    if (sight.vector.frequencies == 0.0 || confidence <= max_confidence) continue;
    const Point2 way = Pose2{0.0, 0.0, -sight.vector.heading_rad} *
                       Point2{r_m * sight.vector.xi, r_m * sight.vector.eta};
    const Point2 place = area_.nodes()[node].position;
    const double way_r = std::hypot(sight.vector.xi, sight.vector.eta);
    if (way_r > max_fix_way_of_r) continue;
    const Fix found{
        {place.x_m - way.x_m, place.y_m - way.y_m, wrap_angle(-sight.vector.heading_rad)},
        r_m * (fix_error_of_r + fix_error_of_way * way_r),
        fix_heading_error_rad + fix_heading_error_of_way * way_r};
    if (distance(found.pose.position(), pose.pose().position()) > max_shift_m) continue;
    if (pose.mismatch(found.pose, found.deviation_m, found.deviation_rad) > max_mismatch) continue;
    max_confidence = confidence;
    fix = found;
  }
  return fix;
}

// Corrects a pose; fixes that follow each other closely count as a part of one.
void HomeFinder::correct_pose(DriftingPose& pose, const Fix& fix, double since_m) {
  const double factor = std::sqrt(std::max(1.0, fix_spacing_m / std::max(since_m, 0.01)));
  pose.correct(fix.pose, factor * fix.deviation_m, factor * fix.deviation_rad);
}

void HomeFinder::see(const HomingView& view) {
  view_ = reduce_view(view, area_.shape().rows, area_.shape().components);
  if (hypothesis_) {
    test_hypothesis();
    return;
  }
  const std::optional<Fix> fix = find_fix(by_odometry_, *view_, likely_error_m() + searched_m_);
  if (!fix) return;
  if (by_odometry_.deviation_m() <=
      sure_deviation_of_r * static_cast<double>(area_.model().typical_distance_m)) {
    correct_pose(by_odometry_, *fix, since_fix_m_);
    since_fix_m_ = 0.0;
  } else {
    const double prior =
        -0.5 * by_odometry_.mismatch(fix->pose, fix->deviation_m, fix->deviation_rad);
    hypothesis_ = Hypothesis{.pose = by_odometry_, .prior_log_odds = prior, .log_odds = prior};
    correct_pose(hypothesis_->pose, *fix, fix_spacing_m);
  }
}

void HomeFinder::test_hypothesis() {
  Hypothesis& tested = *hypothesis_;
  const double spacing_m =
      test_spacing_of_r * static_cast<double>(area_.model().typical_distance_m);
  if (tested.since_test_m < spacing_m) return;
  tested.since_test_m = 0.0;
  const std::optional<Fix> fix = find_fix(tested.pose, *view_, nodes_radius_m_);
  if (fix) {
    correct_pose(tested.pose, *fix, tested.since_fix_m);
    tested.since_fix_m = 0.0;
    tested.log_odds += std::log(agreeing_if_right / agreeing_by_chance);
  } else if (distance(tested.pose.pose().position(), {}) <= area_radius_m_) {
    tested.log_odds += std::log((1.0 - agreeing_if_right) / (1.0 - agreeing_by_chance));
  }
  tested.log_odds = std::min(tested.log_odds, max_log_odds);
  if (tested.log_odds < tested.prior_log_odds + wrong_log_odds) drop_hypothesis();
}

void HomeFinder::drop_hypothesis() {
  hypothesis_.reset();
  if (state_ == ChainState::homing) {
    state_ = search_radius_m_ > 0.0 ? ChainState::searching : ChainState::travelling;
  }
}

ChainDecision HomeFinder::move_to(Point2 place) {
  const Point2 ahead = inverse(estimate().pose()) * place;
  moved_ = {};
  return {state_, 0, std::atan2(ahead.y_m, ahead.x_m),
          std::min(options_.max_step_m, std::hypot(ahead.x_m, ahead.y_m))};
}

void HomeFinder::begin_detour() {
  if (area_.nodes().size() == 1) return;
  detour_node_ = next_detour_;
  next_detour_ = next_detour_ % (area_.nodes().size() - 1) + 1;
  steps_without_progress_ = 0;
}

// Moves towards home. Where that brings the robot no nearer, something is in the way: the robot
// moves to the place of a snapshot, at which the learning walk was, and tries again from there.
ChainDecision HomeFinder::move_home() {
  const auto nodes = area_.nodes();
  const double home_m = distance(estimate().pose().position(), {});
  ++steps_without_progress_;
  if (home_m < min_home_m_ - spiral_point_radius_m) {
    min_home_m_ = home_m;
    if (!detour_node_) steps_without_progress_ = 0;
  }
  const bool ends_detour =
      detour_node_ && distance(estimate().pose().position(), nodes[*detour_node_].position) <=
                          spiral_point_radius_m;
  if (ends_detour || steps_without_progress_ > max_steps_without_progress) {
    const bool begins = !detour_node_;
    detour_node_.reset();
    if (begins) begin_detour();
    steps_without_progress_ = 0;
    min_home_m_ = std::numeric_limits<double>::infinity();
  }
  return move_to(detour_node_ ? nodes[*detour_node_].position : Point2{});
}

// A spiral around home whose turns are as far apart as the area is wide; a second one is twice as
// dense.
ChainDecision HomeFinder::search() {
  const auto place = [&] {
    const double r_m = spiral_turn_m_ * spiral_angle_rad_ / spiral_circle_rad;
    return Point2{r_m * std::cos(spiral_angle_rad_), r_m * std::sin(spiral_angle_rad_)};
  };
  if (search_radius_m_ == 0.0) {
    search_radius_m_ = std::max(options_.error_factor * by_odometry_.deviation_m(),
                                static_cast<double>(area_.model().reach_m));
    spiral_turn_m_ = area_radius_m_;
  }
  state_ = ChainState::searching;
  ++steps_to_point_;
  while (distance(by_odometry_.pose().position(), place()) <= spiral_point_radius_m ||
         steps_to_point_ > max_steps_per_point) {
    steps_to_point_ = 0;
    const double slope_m = spiral_turn_m_ / spiral_circle_rad;
    spiral_angle_rad_ += options_.max_step_m / std::hypot(slope_m * spiral_angle_rad_, slope_m);
    searched_m_ = std::max(searched_m_, slope_m * spiral_angle_rad_);
    if (slope_m * spiral_angle_rad_ <= search_radius_m_) continue;
    if (spiral_turn_m_ < area_radius_m_) {
      state_ = ChainState::lost;
      return {state_, 0, 0.0, 0.0};
    }
    spiral_turn_m_ = 0.5 * area_radius_m_;
    spiral_angle_rad_ = 0.0;
  }
  return move_to(place());
}

// The last metre, by the snapshot at home alone.
ChainDecision HomeFinder::approach() {
  ChainDecision decision = follower_->decide(*view_, moved_);
  moved_ = {};
  decision.target = 0;
  const bool is_at_home = distance(estimate().pose().position(), {}) <=
                          arrival_error_m + 3.0 * estimate().deviation_m();
  if (decision.state == ChainState::arrived && is_at_home) {
    state_ = ChainState::arrived;
    return decision;
  }
  if (decision.state != ChainState::arrived && decision.state != ChainState::lost) {
    state_ = ChainState::homing;
    return {state_, 0, decision.turn_rad, decision.advance_m};
  }
  follower_.reset();
  drop_hypothesis();
  begin_detour();
  if (++failed_ends_ >= max_failed_ends) {
    state_ = ChainState::lost;
    return {state_, 0, 0.0, 0.0};
  }
  return search();
}

ChainDecision HomeFinder::decide() {
  if (state_ == ChainState::arrived || state_ == ChainState::lost) return {state_, 0, 0.0, 0.0};
  if (follower_) return view_ ? approach() : ChainDecision{state_, 0, 0.0, 0.0};
  const double home_m = distance(estimate().pose().position(), {});
  const auto reach_m = static_cast<double>(area_.model().reach_m);
  const bool is_sure =
      hypothesis_ ? hypothesis_->log_odds >= sure_log_odds
                  : by_odometry_.deviation_m() <= reach_m && since_fix_m_ <= max_way_without_fix_m;
  if (is_sure) state_ = ChainState::homing;
  if (is_sure && view_ && !detour_node_ &&
      home_m <= std::max(0.5 * reach_m, spiral_point_radius_m)) {
    follower_ = std::make_unique<ChainFollower>(first_snapshot(area_), ChainDirection::forward);
    moved_ = {};
    return approach();
  }
  if (hypothesis_ && home_m > spiral_point_radius_m) return move_home();
  if (search_radius_m_ > 0.0 || home_m <= spiral_point_radius_m) return search();
  return move_home();
}

}  // namespace panonav
