#include "panonav/route/chain_pilot.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/portable_math.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/route/internal/portable_pose.hpp"
#include "panonav/route/internal/snapshot_sight.hpp"

namespace panonav {

namespace {

// Home vectors shorter than this, in units of R, end at a snapshot that is not the last one: from
// there the vector itself says where the robot is.
constexpr double near_length = 0.1;
// In other light the images differ beside a snapshot, too. There homing has ended where home
// vectors are shorter than this, in units of R. A robot has arrived where odometry expects the last
// snapshot no farther than this from the end of homing: if both are as much off, at half a metre.
constexpr double converged_length = 2.0 * near_length;
constexpr double arrival_radius_m = 0.35;
// A robot has arrived this near to the last snapshot.
constexpr double end_radius_m = 0.5;
// A way point is reached at this distance, the tolerance of the legs.
constexpr double way_point_radius_m = 0.15;
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
constexpr double full_turn_rad = 2.0 * std::numbers::pi;

// Returns the distance between turns of a spiral: half as far as homing reaches.
double spiral_turn_m(const ChainRoute& route) noexcept {
  return 0.5 * static_cast<double>(route.header.model.reach_m);
}

}  // namespace

// Unpacks the snapshot of a node into the workspace.
CoefficientView ChainPilot::snapshot_view(std::size_t node) const noexcept {
  const ChainHeader& header = route_.header;
  const std::size_t size = workspace_size(header.shape) / 2;
  const std::span cosines = workspace_.first(size);
  const std::span sines = workspace_.subspan(size, size);
  const ChainStop& stop = route_.stops[node];
  const SnapshotShape shape = choose_shape(header.shape, stop.is_fine);
  decode_snapshot({stop.snapshot, shape.bytes()}, shape, cosines, sines);
  return {.rows = header.shape.rows,
          .components = header.shape.components,
          .all_cosines = cosines.data(),
          .all_sines = sines.data(),
          .has_elevations = header.bottom_rad != 0.0F || header.top_rad != 0.0F,
          .bottom_rad = static_cast<double>(header.bottom_rad),
          .top_rad = static_cast<double>(header.top_rad)};
}

std::size_t ChainPilot::step_towards_end(std::size_t node) const noexcept {
  return direction_ == ChainDirection::forward ? node + 1 : node - 1;
}

std::optional<std::size_t> ChainPilot::next_snapshot(std::size_t node) const noexcept {
  const std::size_t last =
      direction_ == ChainDirection::forward ? route_.stops.size() - 1 : std::size_t{0};
  while (node != last) {
    node = step_towards_end(node);
    if (route_.stops[node].has_snapshot()) return node;
  }
  return std::nullopt;
}

// Largest expected error of the position: that of the odometry in both drives, and of the last fix.
// It does not grow during a search, else every place would come into question.
double ChainPilot::error_m() const noexcept {
  const double fix_m = near_length * static_cast<double>(route_.header.model.typical_distance_m);
  const double driven_m = spiral_points_ == 0 ? since_fix_m_ : fix_to_search_m_;
  return portable::hypot(fix_m, odometry().position_error_m(driven_m));
}

double ChainPilot::path_to_target_m() const {
  double sum_m = portable_distance(pose_.position(), position(way_point_));
  for (std::size_t node = way_point_; node != target_; node = step_towards_end(node)) {
    sum_m += portable_distance(position(node), position(step_towards_end(node)));
  }
  return sum_m;
}

SnapshotSight ChainPilot::look_at(std::size_t node, const CoefficientView& view,
                                  bool any_heading) noexcept {
  const double half_rad = compass_error_rad + odometry().heading_error_rad(since_fix_m_);
  HeadingWindow window;
  if (!any_heading && half_rad < std::numbers::pi) {
    window = {static_cast<float>(-pose_.heading_rad), static_cast<float>(half_rad)};
  }
  const bool is_known = sight_ && sight_node_ == node &&
                        sight_window_.middle_rad == window.middle_rad &&
                        sight_window_.half_width_rad == window.half_width_rad;
  if (!is_known) sight_ = look_at_snapshot(snapshot_view(node), view, window);
  sight_node_ = node;
  sight_window_ = window;
  return *sight_;
}

// True if the view is from beside the snapshot, where vectors have no direction, or if nine of ten
// home vectors like this one are right.
bool ChainPilot::is_confident(const SnapshotSight& sight) const {
  return sight.difference <= static_cast<double>(route_.header.model.arrived_difference) ||
         sight.confidence >= static_cast<double>(route_.header.model.homing_confidence);
}

// Returns the way to the snapshot, along the axes of the chain.
Point2 ChainPilot::home_from_robot(const HomeVector& vector) const {
  const auto r_m = static_cast<double>(route_.header.model.typical_distance_m);
  return transform({0.0, 0.0, wrap_angle(-vector.heading_rad)},
                   {r_m * vector.xi, r_m * vector.eta});
}

// True if the home vector ends where the error of odometry allows the target to be.
bool ChainPilot::agrees_with_odometry(const SnapshotSight& sight) const {
  const Point2 home = home_from_robot(sight.vector);
  const Point2 end{pose_.x_m + home.x_m, pose_.y_m + home.y_m};
  return sight.vector.frequencies > 0.0 &&
         portable_distance(end, position(target_)) <= options_.error_factor * error_m();
}

void ChainPilot::start(const CoefficientView& view) {
  const bool forward = direction_ == ChainDirection::forward;
  const std::size_t first = forward ? 0 : route_.stops.size() - 1;
  target_ = first;
  SnapshotSight sight = look_at(target_, view, true);
  if (!is_confident(sight)) {
    for (std::size_t node = 0; node < route_.stops.size(); ++node) {
      if (!route_.stops[node].has_snapshot()) continue;
      const SnapshotSight other = look_at(node, view, true);
      if (other.difference < sight.difference) target_ = node, sight = other;
    }
  }
  way_point_ = target_;
  has_started_ = true;
  const Point2 place = position(target_);
  pose_ = {place.x_m, place.y_m, wrap_angle(-sight.vector.heading_rad)};
  if (is_confident(sight) || target_ == first) {
    begin_homing();
  } else {
    state_ = ChainState::lost;
  }
}

void ChainPilot::aim_at(std::size_t node) {
  way_point_ = step_towards_end(target_);
  target_ = node;
  since_target_m_ = 0.0;
  expected_path_m_ = path_to_target_m();
  state_ = ChainState::travelling;
}

// Sets the pose from the home vector to the target.
void ChainPilot::fix_pose(const HomeVector& vector) {
  const double heading_rad = wrap_angle(-vector.heading_rad);
  const Point2 home = home_from_robot(vector);
  const Pose2 fixed{position(target_).x_m - home.x_m, position(target_).y_m - home.y_m,
                    heading_rad};
  learn_drift(fixed);
  pose_ = fixed;
  fixed_pose_ = fixed;
  heading_by_odometry_rad_ = heading_rad;
  since_fix_m_ = 0.0;
  spiral_points_ = 0;
  failed_confidence_ = -1.0;
}

// Learns systematic errors from where odometry has led since the last fix [normalised least mean
// squares]. They are limited to what the odometry's errors allow.
void ChainPilot::learn_drift(const Pose2& fixed) {
  if (since_fix_m_ < min_learning_m) return;
  const Point2 off{(fixed.x_m - pose_.x_m) / since_fix_m_, (fixed.y_m - pose_.y_m) / since_fix_m_};
  const Point2 moved{(pose_.x_m - fixed_pose_.x_m) / since_fix_m_,
                     (pose_.y_m - fixed_pose_.y_m) / since_fix_m_};
  const double size = 1.0 + moved.x_m * moved.x_m + moved.y_m * moved.y_m;
  drift_m_per_m_.x_m += learning_gain * off.x_m / size;
  drift_m_per_m_.y_m += learning_gain * off.y_m / size;
  scale_error_ += learning_gain * (off.x_m * moved.x_m + off.y_m * moved.y_m) / size;
  const double drift = portable::hypot(drift_m_per_m_.x_m, drift_m_per_m_.y_m);
  const double factor = drift > 0.0 ? std::min(1.0, 2.0 * odometry().drift / drift) : 1.0;
  drift_m_per_m_ = {factor * drift_m_per_m_.x_m, factor * drift_m_per_m_.y_m};
  const double max_scale = 2.0 * odometry().distance_error;
  scale_error_ = std::clamp(scale_error_, -max_scale, max_scale);
  const double max_turn = 2.0 * odometry().heading_error_rad_per_m;
  turn_rad_per_m_ = std::clamp(
      turn_rad_per_m_ +
          learning_gain * wrap_angle(fixed.heading_rad - heading_by_odometry_rad_) / since_fix_m_,
      -max_turn, max_turn);
}

void ChainPilot::begin_homing() {
  state_ = ChainState::homing;
  homing_stage_ = 0;
  homing_steps_ = 0;
  approach_.restart();
  approach_confidence_ = -1.0;
}

void ChainPilot::fail_approach() {
  failed_confidence_ = std::max(failed_confidence_, approach_confidence_);
  since_approach_m_ = 0.0;
  begin_search();
}

// A spiral around the place of the target by odometry, whose turns are half as far apart
// as homing reaches, up to the error of the odometry.
void ChainPilot::begin_search() {
  const bool continues = spiral_points_ > 0;
  state_ = ChainState::searching;
  steps_to_point_ = 0;
  if (continues) return;
  search_steps_ = 0;
  fix_to_search_m_ = since_fix_m_;
  const double radius_m = options_.error_factor * error_m();
  spiral_point_ = 0;
  spiral_angle_rad_ = 0.0;
  double angle_rad = 0.0;
  std::size_t points = 0;
  while (points == 0 || spiral_turn_m(route_) * angle_rad / full_turn_rad <= radius_m) {
    ++points;
    angle_rad = next_spiral_angle(angle_rad);
  }
  spiral_points_ = points;
}

// Returns a place on the spiral around the target.
Point2 ChainPilot::spiral_place(double angle_rad) const noexcept {
  const double r_m = spiral_turn_m(route_) * angle_rad / full_turn_rad;
  const auto [cosine, sine] = portable::cosine_sine(angle_rad);
  return {position(target_).x_m + r_m * cosine, position(target_).y_m + r_m * sine};
}

// Returns the angle of the place that is a step away along the spiral.
double ChainPilot::next_spiral_angle(double angle_rad) const noexcept {
  const double slope_m = spiral_turn_m(route_) / full_turn_rad;
  return angle_rad + options_.max_step_m / portable::hypot(slope_m * angle_rad, slope_m);
}

ChainDecision ChainPilot::move_to(Point2 place) const {
  const Point2 ahead = transform_back(pose_, place);
  return {state_, target_, portable::atan2(ahead.y_m, ahead.x_m),
          std::min(options_.max_step_m, portable::hypot(ahead.x_m, ahead.y_m))};
}

ChainDecision ChainPilot::end_with(ChainState state) {
  state_ = state;
  return {state_, target_, 0.0, 0.0};
}

ChainDecision ChainPilot::travel(const CoefficientView& view) {
  while (way_point_ != target_ &&
         portable_distance(pose_.position(), position(way_point_)) <= way_point_radius_m) {
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

// True if homing, whose last stage stops now, has ended beside the target although the images
// differ more than they did beside snapshots in one light: nine of ten home vectors like those of
// this stage are right, and odometry allows the place.
bool ChainPilot::has_converged(const HomeVector& vector, bool has_next) const {
  const double off_m = portable_distance(pose_.position(), position(target_));
  return homing_stage_ + 1 == homing_stages && vector.length() <= converged_length &&
         approach_confidence_ >= static_cast<double>(route_.header.model.homing_confidence) &&
         off_m <= error_m() && (has_next || off_m <= arrival_radius_m);
}

ChainDecision ChainPilot::home(const CoefficientView& view) {
  SnapshotSight sight = look_at(target_, view, false);
  if (homing_stage_ == 1) {
    // Most wrong ends are too far from home for all but the lowest frequencies.
    const int highest = std::min(coarse_frequency, route_.header.shape.components - 2);
    sight.vector = find_home_vector(snapshot_view(target_), view, {.highest = highest});
  }
  const HomeVector& vector = sight.vector;
  const auto r_m = static_cast<double>(route_.header.model.typical_distance_m);
  const bool is_too_far = portable_distance(pose_.position(), position(target_)) >
                          options_.error_factor * error_m() + r_m * near_length;
  const std::optional<std::size_t> next = next_snapshot(target_);
  // Images differ the more the farther the robot is from a snapshot: those called similar were
  // taken up to `near_length` away, which is too far from the end where R is large.
  const double end_factor = next ? 1.0 : std::min(1.0, end_radius_m / (near_length * r_m));
  const bool is_beside =
      !is_too_far &&
      sight.difference <= end_factor * static_cast<double>(route_.header.model.arrived_difference);
  approach_confidence_ = std::max(approach_confidence_, sight.confidence);
  approach_.add_difference(sight.difference);
  const double advance_m = approach_.next_m(vector, r_m, options_.max_step_m);
  const bool stops = advance_m < options_.stop_step_m || approach_.steps_since_min() >= patience ||
                     homing_steps_ >= options_.max_homing_steps;
  const bool is_similar_end = is_beside && (stops || (next && vector.length() <= near_length));
  if (is_similar_end || (stops && has_converged(vector, next.has_value()))) {
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

ChainDecision ChainPilot::search(const CoefficientView& view) {
  const SnapshotSight sight = look_at(target_, view, false);
  // After an approach that failed, the robot leaves the place before it tries again.
  const bool is_new = since_approach_m_ > 0.5 * static_cast<double>(route_.header.model.reach_m) ||
                      sight.confidence > failed_confidence_;
  if (is_new && is_confident(sight) && agrees_with_odometry(sight)) {
    begin_homing();
    return home(view);
  }
  while (
      spiral_point_ < spiral_points_ &&
      (portable_distance(pose_.position(), spiral_place(spiral_angle_rad_)) <= way_point_radius_m ||
       steps_to_point_ >= max_steps_to_spiral_point)) {
    ++spiral_point_;
    spiral_angle_rad_ = next_spiral_angle(spiral_angle_rad_);
    steps_to_point_ = 0;
  }
  if (spiral_point_ >= spiral_points_) return end_with(ChainState::lost);
  ++steps_to_point_;
  return move_to(spiral_place(spiral_angle_rad_));
}

ChainDecision ChainPilot::decide(const CoefficientView& view, const Pose2& moved) noexcept {
  if (state_ == ChainState::arrived || state_ == ChainState::lost) return end_with(state_);
  sight_.reset();
  if (!has_started_) {
    start(view);
  } else {
    const double step_m = portable::hypot(moved.x_m, moved.y_m);
    const Pose2 before = pose_;
    pose_ = compose(pose_, moved);
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
  const std::size_t max_search_steps = max_steps_per_spiral_point * spiral_points_;
  if (spiral_points_ > 0 && ++search_steps_ > max_search_steps) return end_with(ChainState::lost);
  switch (state_) {
    case ChainState::travelling:
      return travel(view);
    case ChainState::homing:
      return home(view);
    case ChainState::searching:
      return search(view);
    case ChainState::arrived:
    case ChainState::lost:
      break;
  }
  return end_with(state_);
}

}  // namespace panonav
