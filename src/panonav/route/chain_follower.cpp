#include "panonav/route/chain_follower.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/route/internal/snapshot_sight.hpp"

namespace panonav {

namespace {

// Home vectors shorter than this, in units of R, end at a snapshot that is not the last one: from
// there the vector itself says where the robot is.
constexpr double near_length = 0.1;
// A way point is reached at this distance, the tolerance of the legs.
constexpr double way_point_radius_m = 0.15;
// Factors of the step when a home vector opposes the one before it, and when it agrees.
constexpr double opposing_factor = 0.5;
constexpr double agreeing_factor = 1.25;
// Half of the window of headings beyond the error of odometry: the error of the compass at a
// snapshot.
constexpr double compass_error_rad = 0.35;
// Part of the newly measured error of odometry that is added to its estimate.
constexpr double learning_gain = 0.5;
// Errors over shorter distances say more of the fixes than of the odometry.
constexpr double min_learning_m = 1.0;
// An approach fails when the view has not become more similar for this many steps.
constexpr int patience = 8;
// All frequencies, then up to this one, then all again.
constexpr int homing_stages = 3;
constexpr int coarse_frequency = 2;
// The path to a target may be this much longer than expected, with detours around obstacles.
constexpr double max_path_factor = 3.0;
constexpr int max_steps_to_spiral_point = 4;
// Largest number of steps of a search, approaches included.
constexpr std::size_t max_steps_per_spiral_point = 3;

}  // namespace

void visit_options(ChainFollowerOptions& options, OptionVisitor& visitor) {
  using T = ChainFollowerOptions;
  constexpr OptionTable table{
      option<&T::max_step_m>("longest motion between two views", 0.001, 100),
      option<&T::stop_step_m>("homing ends when its steps are shorter than this", 0.001, 100),
      option<&T::max_homing_steps>("largest number of steps of one approach to a snapshot", 1, 1e6),
      option<&T::error_factor>("radius of the search for a snapshot, in errors of the odometry", 1,
                               100),
  };
  table.visit(options, visitor);
}

ChainFollower::ChainFollower(SnapshotChain chain, ChainDirection direction,
                             const ChainFollowerOptions& options, const ChainOdometry& odometry)
    : chain_(std::move(chain)), direction_(direction), options_(options), odometry_(odometry) {
  require(!chain_.nodes().empty(), "nodes of the chain", 0.0, ">= 1");
  require(chain_.nodes().back().has_snapshot(), "snapshots of the last node", 0.0, "1");
  validate(options_);
  validate(odometry_);
}

std::size_t ChainFollower::step_towards_end(std::size_t node) const noexcept {
  return direction_ == ChainDirection::forward ? node + 1 : node - 1;
}

std::optional<std::size_t> ChainFollower::next_snapshot(std::size_t node) const noexcept {
  const std::size_t last =
      direction_ == ChainDirection::forward ? chain_.nodes().size() - 1 : std::size_t{0};
  while (node != last) {
    node = step_towards_end(node);
    if (chain_.nodes()[node].has_snapshot()) return node;
  }
  return std::nullopt;
}

// Largest expected error of the position: that of the odometry in both drives, and of the last fix.
// It does not grow during a search, else every place would come into question.
double ChainFollower::error_m() const noexcept {
  const double fix_m = near_length * static_cast<double>(chain_.model().typical_distance_m);
  const double driven_m = spiral_.empty() ? since_fix_m_ : fix_to_search_m_;
  return std::hypot(fix_m, odometry_.position_error_m(driven_m));
}

double ChainFollower::path_to_target_m() const {
  double sum_m = distance(pose_.position(), position(way_point_));
  for (std::size_t node = way_point_; node != target_; node = step_towards_end(node)) {
    sum_m += distance(position(node), position(step_towards_end(node)));
  }
  return sum_m;
}

SnapshotSight ChainFollower::look_at(std::size_t node, const HomingView& view,
                                     bool any_heading) const {
  const double half_rad = compass_error_rad + odometry_.heading_error_rad(since_fix_m_);
  std::optional<HeadingWindow> window;
  if (!any_heading && half_rad < std::numbers::pi) {
    window = {static_cast<float>(-pose_.heading_rad), static_cast<float>(half_rad)};
  }
  return look_at_snapshot(chain_.view(node), view, window);
}

// True if the view is from beside the snapshot, where vectors have no direction, or if nine of ten
// home vectors like this one are right.
bool ChainFollower::is_confident(const SnapshotSight& sight) const {
  return sight.difference <= static_cast<double>(chain_.model().arrived_difference) ||
         sight.confidence >= static_cast<double>(chain_.model().homing_confidence);
}

// Returns the way to the snapshot, along the axes of the chain.
Point2 ChainFollower::home_from_robot(const HomeVector& vector) const {
  const auto r_m = static_cast<double>(chain_.model().typical_distance_m);
  return Pose2{0.0, 0.0, wrap_angle(-vector.heading_rad)} *
         Point2{r_m * vector.xi, r_m * vector.eta};
}

// True if the home vector ends where the error of odometry allows the target to be.
bool ChainFollower::agrees_with_odometry(const SnapshotSight& sight) const {
  const Point2 home = home_from_robot(sight.vector);
  const Point2 end{pose_.x_m + home.x_m, pose_.y_m + home.y_m};
  return sight.vector.frequencies > 0.0 &&
         distance(end, position(target_)) <= options_.error_factor * error_m();
}

void ChainFollower::start(const HomingView& view) {
  const bool forward = direction_ == ChainDirection::forward;
  target_ = forward ? 0 : chain_.nodes().size() - 1;
  SnapshotSight sight = look_at(target_, view, true);
  if (!is_confident(sight)) {
    for (std::size_t node = 0; node < chain_.nodes().size(); ++node) {
      if (!chain_.nodes()[node].has_snapshot()) continue;
      const SnapshotSight other = look_at(node, view, true);
      if (other.difference < sight.difference) target_ = node, sight = other;
    }
  }
  way_point_ = target_;
  has_started_ = true;
  const Point2 place = position(target_);
  pose_ = {place.x_m, place.y_m, wrap_angle(-sight.vector.heading_rad)};
  if (is_confident(sight)) {
    begin_homing();
  } else {
    state_ = ChainState::lost;
  }
}

void ChainFollower::aim_at(std::size_t node) {
  way_point_ = step_towards_end(target_);
  target_ = node;
  since_target_m_ = 0.0;
  expected_path_m_ = path_to_target_m();
  state_ = ChainState::travelling;
}

// Sets the pose from the home vector to the target.
void ChainFollower::fix_pose(const HomeVector& vector) {
  const double heading_rad = wrap_angle(-vector.heading_rad);
  const Point2 home = home_from_robot(vector);
  const Pose2 fixed{position(target_).x_m - home.x_m, position(target_).y_m - home.y_m,
                    heading_rad};
  learn_drift(fixed);
  pose_ = fixed;
  fixed_pose_ = fixed;
  heading_by_odometry_rad_ = heading_rad;
  since_fix_m_ = 0.0;
  spiral_.clear();
  failed_confidence_ = -1.0;
}

// Learns systematic errors from where odometry has led since the last fix [normalised least mean
// squares]. They are limited to what the odometry's errors allow.
void ChainFollower::learn_drift(const Pose2& fixed) {
  if (since_fix_m_ < min_learning_m) return;
  const Point2 off{(fixed.x_m - pose_.x_m) / since_fix_m_, (fixed.y_m - pose_.y_m) / since_fix_m_};
  const Point2 moved{(pose_.x_m - fixed_pose_.x_m) / since_fix_m_,
                     (pose_.y_m - fixed_pose_.y_m) / since_fix_m_};
  const double size = 1.0 + moved.x_m * moved.x_m + moved.y_m * moved.y_m;
  drift_m_per_m_.x_m += learning_gain * off.x_m / size;
  drift_m_per_m_.y_m += learning_gain * off.y_m / size;
  scale_error_ += learning_gain * (off.x_m * moved.x_m + off.y_m * moved.y_m) / size;
  const double drift = std::hypot(drift_m_per_m_.x_m, drift_m_per_m_.y_m);
  const double factor = drift > 0.0 ? std::min(1.0, 2.0 * odometry_.drift / drift) : 1.0;
  drift_m_per_m_ = {factor * drift_m_per_m_.x_m, factor * drift_m_per_m_.y_m};
  const double max_scale = 2.0 * odometry_.distance_error;
  scale_error_ = std::clamp(scale_error_, -max_scale, max_scale);
  const double max_turn = 2.0 * odometry_.heading_error_rad_per_m;
  turn_rad_per_m_ = std::clamp(
      turn_rad_per_m_ +
          learning_gain * wrap_angle(fixed.heading_rad - heading_by_odometry_rad_) / since_fix_m_,
      -max_turn, max_turn);
}

void ChainFollower::begin_homing() {
  state_ = ChainState::homing;
  homing_stage_ = 0;
  homing_steps_ = 0;
  step_factor_ = 1.0;
  last_direction_rad_.reset();
  min_difference_ = 2.0;
  steps_since_min_ = 0;
  approach_confidence_ = -1.0;
}

void ChainFollower::fail_approach() {
  failed_confidence_ = std::max(failed_confidence_, approach_confidence_);
  since_approach_m_ = 0.0;
  begin_search();
}

// A spiral around the place of the target by odometry, whose turns are half as far apart
// as homing reaches, up to the error of the odometry.
void ChainFollower::begin_search() {
  const bool continues = !spiral_.empty();
  state_ = ChainState::searching;
  steps_to_point_ = 0;
  if (continues) return;
  search_steps_ = 0;
  fix_to_search_m_ = since_fix_m_;
  const auto turn_m = 0.5 * static_cast<double>(chain_.model().reach_m);
  const double radius_m = options_.error_factor * error_m();
  spiral_point_ = 0;
  double angle_rad = 0.0;
  for (;;) {
    const double r_m = turn_m * angle_rad / (2.0 * std::numbers::pi);
    if (r_m > radius_m && !spiral_.empty()) break;
    spiral_.push_back({position(target_).x_m + r_m * std::cos(angle_rad),
                       position(target_).y_m + r_m * std::sin(angle_rad)});
    // The next point is a step away along the spiral.
    const double slope_m = turn_m / (2.0 * std::numbers::pi);
    angle_rad += options_.max_step_m / std::hypot(r_m, slope_m);
  }
}

ChainDecision ChainFollower::move_to(Point2 place) const {
  const Point2 ahead = inverse(pose_) * place;
  return {state_, target_, std::atan2(ahead.y_m, ahead.x_m),
          std::min(options_.max_step_m, std::hypot(ahead.x_m, ahead.y_m))};
}

ChainDecision ChainFollower::end_with(ChainState state) {
  state_ = state;
  return {state_, target_, 0.0, 0.0};
}

ChainDecision ChainFollower::travel(const HomingView& view) {
  while (way_point_ != target_ &&
         distance(pose_.position(), position(way_point_)) <= way_point_radius_m) {
    way_point_ = step_towards_end(way_point_);
  }
  const double left_m = path_to_target_m();
  const bool is_there = way_point_ == target_ && left_m <= way_point_radius_m;
  if (is_there || left_m <= options_.error_factor * error_m()) {
    const SnapshotSight sight = look_at(target_, view, false);
    if (is_there || (is_confident(sight) && agrees_with_odometry(sight))) {
      begin_homing();
      return home(view);
    }
  }
  if (since_target_m_ > max_path_factor * (expected_path_m_ + 1.0)) {
    begin_search();
    return search(view);
  }
  return move_to(position(way_point_));
}

// Returns the length of the next step of an approach: halved when home vectors oppose each other
// [S06 section 3], as seen from the snapshot.
double ChainFollower::next_step_m(const SnapshotSight& sight) {
  const HomeVector& vector = sight.vector;
  const double direction_rad = vector.direction_rad() - vector.heading_rad;
  if (last_direction_rad_) {
    const bool is_opposing = std::cos(direction_rad - *last_direction_rad_) < 0.0;
    step_factor_ = is_opposing ? step_factor_ * opposing_factor
                               : std::min(1.0, step_factor_ * agreeing_factor);
  }
  last_direction_rad_ = direction_rad;
  approach_confidence_ = std::max(approach_confidence_, sight.confidence);
  ++steps_since_min_;
  if (sight.difference < min_difference_) {
    min_difference_ = sight.difference;
    steps_since_min_ = 0;
  }
  const auto r_m = static_cast<double>(chain_.model().typical_distance_m);
  return step_factor_ * std::min(options_.max_step_m, r_m * vector.length());
}

ChainDecision ChainFollower::home(const HomingView& view) {
  SnapshotSight sight = look_at(target_, view, false);
  if (homing_stage_ == 1) {
    // Most wrong ends are too far from home for all but the lowest frequencies.
    const int highest = std::min(coarse_frequency, chain_.shape().components - 2);
    sight.vector = home_vector(chain_.view(target_), view, {.highest = highest});
  }
  const HomeVector& vector = sight.vector;
  const auto r_m = static_cast<double>(chain_.model().typical_distance_m);
  const bool is_too_far = distance(pose_.position(), position(target_)) >
                          options_.error_factor * error_m() + r_m * near_length;
  const bool is_beside =
      !is_too_far && sight.difference <= static_cast<double>(chain_.model().arrived_difference);
  const std::optional<std::size_t> next = next_snapshot(target_);
  const double advance_m = next_step_m(sight);
  const bool stops = advance_m < options_.stop_step_m || steps_since_min_ >= patience ||
                     homing_steps_ >= options_.max_homing_steps;
  if (is_beside && (stops || (next && vector.length() <= near_length))) {
    fix_pose(vector);
    if (!next) return end_with(ChainState::arrived);
    aim_at(*next);
    return travel(view);
  }
  if (stops && !is_too_far && homing_stage_ + 1 < homing_stages) {
    const int next_stage = homing_stage_ + 1;
    begin_homing();
    homing_stage_ = next_stage;
    return home(view);
  }
  if (stops || is_too_far || vector.frequencies == 0.0) {
    fail_approach();
    return search(view);
  }
  if (is_confident(sight)) pose_.heading_rad = wrap_angle(-vector.heading_rad);  // does not drift
  ++homing_steps_;
  return {state_, target_, vector.direction_rad(), advance_m};
}

ChainDecision ChainFollower::search(const HomingView& view) {
  const SnapshotSight sight = look_at(target_, view, false);
  // After an approach that failed, the robot leaves the place before it tries again.
  const bool is_new = since_approach_m_ > 0.5 * static_cast<double>(chain_.model().reach_m) ||
                      sight.confidence > failed_confidence_;
  if (is_new && is_confident(sight) && agrees_with_odometry(sight)) {
    begin_homing();
    return home(view);
  }
  while (spiral_point_ < spiral_.size() &&
         (distance(pose_.position(), spiral_[spiral_point_]) <= way_point_radius_m ||
          steps_to_point_ >= max_steps_to_spiral_point)) {
    ++spiral_point_;
    steps_to_point_ = 0;
  }
  if (spiral_point_ >= spiral_.size()) return end_with(ChainState::lost);
  ++steps_to_point_;
  return move_to(spiral_[spiral_point_]);
}

ChainDecision ChainFollower::decide(const HomingView& view, const Pose2& moved) {
  require(is_finite(moved), "motion between views", moved.x_m, "finite");
  if (state_ == ChainState::arrived || state_ == ChainState::lost) return end_with(state_);
  const HomingView reduced = reduce_view(view, chain_.shape().rows, chain_.shape().components);
  if (!has_started_) {
    start(reduced);
  } else {
    const double step_m = std::hypot(moved.x_m, moved.y_m);
    const Pose2 before = pose_;
    pose_ = pose_ * moved;
    pose_.x_m += scale_error_ * (pose_.x_m - before.x_m) + step_m * drift_m_per_m_.x_m;
    pose_.y_m += scale_error_ * (pose_.y_m - before.y_m) + step_m * drift_m_per_m_.y_m;
    pose_.heading_rad = wrap_angle(pose_.heading_rad + step_m * turn_rad_per_m_);
    heading_by_odometry_rad_ =
        wrap_angle(heading_by_odometry_rad_ + moved.heading_rad + step_m * turn_rad_per_m_);
    since_fix_m_ += step_m;
    since_target_m_ += step_m;
    since_approach_m_ += step_m;
  }
  // Obstacles and approaches that fail may delay a search without end.
  const std::size_t max_search_steps = max_steps_per_spiral_point * spiral_.size();
  if (!spiral_.empty() && ++search_steps_ > max_search_steps) return end_with(ChainState::lost);
  switch (state_) {
    case ChainState::travelling:
      return travel(reduced);
    case ChainState::homing:
      return home(reduced);
    case ChainState::searching:
      return search(reduced);
    case ChainState::arrived:
    case ChainState::lost:
      break;
  }
  return end_with(state_);
}

}  // namespace panonav
