#include "lab/s06/snapshot_chain.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav::lab {

namespace {

// Recorder: largest deviation of home vectors between a candidate and the last snapshot from
// odometry.
constexpr double direction_tolerance_rad = 0.6;
// Spacing of snapshots as a fraction of the distance over which homing worked, so that a robot off
// the route or in other light still reaches the next snapshot.
constexpr double spacing_factor = 0.7;
constexpr double min_spacing_m = 0.3;
// Smaller distances to a snapshot are not compared with odometry, because noise dominates the
// direction of the home vector there.
constexpr double min_compared_distance_m = 0.15;
// Smallest distance between two stored views; views in between are skipped.
constexpr double view_spacing_m = 0.1;

// Follower: length of the home vector, in units of R, below which it continues to the next
// snapshot.
constexpr double max_near_vector_length = 0.1;
// Largest accepted angle between a home vector and the direction of the snapshot by odometry.
constexpr double max_direction_deviation_rad = 1.0;
// Largest accepted difference between the headings by compass and by odometry, at any distance: the
// drift of odometry between two snapshots is smaller.
constexpr double max_heading_deviation_rad = 0.5;
// Distance to the expected snapshot below which the direction of vectors is not checked, because
// the drift of odometry dominates there.
constexpr double near_m = 0.4;
// Distance without reaching a snapshot after which the robot reports lost.
constexpr double max_unseen_distance_m = 10.0;

double length(const Pose2& step) {
  return std::hypot(step.x_m, step.y_m);
}

// True if the home vector from one view to another points in the direction that odometry states, or
// if they are too near to compare.
bool agrees_with_odometry(const HomingView& from, const HomingView& to, const Pose2& from_to) {
  if (length(from_to) < min_compared_distance_m) return true;
  const HomeVector vector = home_vector(to, from);
  if (vector.length() == 0.0) return false;
  const double error_rad = vector.direction_rad() - std::atan2(from_to.y_m, from_to.x_m);
  return std::abs(wrap_angle(error_rad)) <= direction_tolerance_rad;
}

}  // namespace

double chain_length_m(const SnapshotChain& chain) noexcept {
  return chain.empty() ? 0.0 : chain.back().travelled_m - chain.front().travelled_m;
}

double bytes_per_metre(const SnapshotChain& chain) noexcept {
  std::size_t floats = 0;
  for (const Snapshot& snapshot : chain) {
    floats += 2 * static_cast<std::size_t>(snapshot.view.rows()) *
                  static_cast<std::size_t>(snapshot.view.components() - 1) +
              4;
  }
  const double length_m = chain_length_m(chain);
  return length_m > 0.0 ? static_cast<double>(sizeof(float) * floats) / length_m : 0.0;
}

ChainRecorder::ChainRecorder(double max_spacing_m) : max_spacing_m_(max_spacing_m) {}

// True if homing works between the last snapshot and `candidate`, the most recent stored view.
bool ChainRecorder::can_home_to_and_from(const StoredView& candidate) const {
  const auto agrees = [](const StoredView& from, const StoredView& to) {
    return agrees_with_odometry(from.view, to.view,
                                inverse(from.snapshot_from_this) * to.snapshot_from_this);
  };
  if (!agrees(candidate, stored_views_.front())) return false;
  return std::all_of(stored_views_.begin(), stored_views_.end(), [&](const StoredView& view) {
    return &view == &candidate || agrees(view, candidate);
  });
}

std::size_t ChainRecorder::add(const HomingView& view, const Pose2& moved) {
  if (chain_.empty()) {
    chain_.push_back({view, 0.0, {}});
    stored_views_.push_back({view, {}, 0.0});
    return 1;
  }
  snapshot_from_robot_ = snapshot_from_robot_ * moved;
  segment_length_m_ += length(moved);
  if (segment_length_m_ - stored_views_.back().path_m < view_spacing_m) return chain_.size();

  stored_views_.push_back({view, snapshot_from_robot_, segment_length_m_});
  const bool too_far = segment_length_m_ > max_spacing_m_;
  if (!too_far && can_home_to_and_from(stored_views_.back())) return chain_.size();
  // Take the farthest stored view within a fraction of the distance over which homing worked, but
  // at least `min_spacing_m`.
  const double reachable_m = stored_views_[stored_views_.size() - 2].path_m;
  const double max_path_m =
      std::max(too_far ? reachable_m : spacing_factor * reachable_m, min_spacing_m);
  std::size_t chosen = 0;
  for (std::size_t i = 1; i < stored_views_.size() && stored_views_[i].path_m <= max_path_m; ++i)
    chosen = i;
  if (chosen == 0 && segment_length_m_ >= min_spacing_m) chosen = 1;
  if (chosen > 0) take_snapshot(chosen);
  return chain_.size();
}

void ChainRecorder::take_snapshot(std::size_t index) {
  const Pose2 old_from_new = stored_views_[index].snapshot_from_this;
  const double path_m = stored_views_[index].path_m;
  chain_.push_back({stored_views_[index].view, chain_.back().travelled_m + path_m, old_from_new});
  stored_views_.erase(stored_views_.begin(),
                      stored_views_.begin() + static_cast<std::ptrdiff_t>(index));
  const Pose2 new_from_old = inverse(old_from_new);
  for (StoredView& view : stored_views_) {
    view.snapshot_from_this = new_from_old * view.snapshot_from_this;
    view.path_m -= path_m;
  }
  snapshot_from_robot_ = new_from_old * snapshot_from_robot_;
  segment_length_m_ -= path_m;
}

SnapshotChain ChainRecorder::finish() const {
  SnapshotChain chain = chain_;
  if (stored_views_.size() > 1) {
    const StoredView& last = stored_views_.back();
    chain.push_back({last.view, chain.back().travelled_m + last.path_m, last.snapshot_from_this});
  }
  return chain;
}

ChainFollower::ChainFollower(SnapshotChain chain, ChainDirection direction,
                             const HomingPursuitOptions& pursuit)
    : chain_(std::move(chain)), direction_(direction), pursuit_options_(pursuit) {
  require(!chain_.empty(), "snapshots of the chain", 0.0, ">= 1");
  validate(pursuit_options_);
}

bool ChainFollower::is_last(std::size_t target) const noexcept {
  return direction_ == ChainDirection::forward ? target + 1 == chain_.size() : target == 0;
}

std::size_t ChainFollower::next_snapshot(std::size_t target) const noexcept {
  return direction_ == ChainDirection::forward ? target + 1 : target - 1;
}

void ChainFollower::aim_at_next(const Pose2& target_from_robot) {
  const Pose2 target_from_next = direction_ == ChainDirection::forward
                                     ? chain_[*target_ + 1].previous_from_this
                                     : inverse(chain_[*target_].previous_from_this);
  target_from_robot_ = inverse(target_from_next) * target_from_robot;
  target_ = next_snapshot(*target_);
  steps_to_target_ = 0;
  segment_length_m_ = length(*target_from_robot_);
  max_steps_to_target_ =
      3 + 3 * static_cast<int>(std::ceil(segment_length_m_ / pursuit_options_.max_step_m));
}

bool ChainFollower::contradicts_odometry(const HomeVector& vector) const noexcept {
  if (!target_from_robot_) return false;
  const double drift_rad = wrap_angle(-vector.heading_rad - target_from_robot_->heading_rad);
  return std::abs(drift_rad) > max_heading_deviation_rad;
}

ChainDecision ChainFollower::approach_last(const HomingView& current) {
  if (!pursuit_) pursuit_.emplace(chain_[*target_].view, pursuit_options_, FourierHomingOptions{});
  const HomingPursuit::Decision step = pursuit_->decide(current);
  ChainDecision decision{ChainState::following, *target_, step.turn_rad, step.advance_m};
  if (step.state == HomingPursuit::State::arrived) decision.state = ChainState::finished;
  if (step.state == HomingPursuit::State::wrong_place ||
      step.state == HomingPursuit::State::exhausted) {
    decision.state = ChainState::lost;
  }
  return decision;
}

void ChainFollower::start_at_most_similar_snapshot(const HomingView& current) {
  double min_difference = 3.0;
  target_ = 0;
  for (std::size_t i = 0; i < chain_.size(); ++i) {
    const double difference = image_difference(chain_[i].view, current);
    if (difference >= min_difference) continue;
    min_difference = difference;
    target_ = i;
  }
  max_steps_to_target_ = pursuit_options_.max_steps;
}

// Returns true and chooses the next snapshot as target if the present one is reached, passed or
// skipped. Views decide, unless odometry contradicts them.
bool ChainFollower::aim_at_next_if_reached(const HomingView& current, const HomeVector& vector) {
  const double r_m = pursuit_options_.typical_distance_m;
  const bool contradicts = contradicts_odometry(vector);
  const bool plausible =
      !target_from_robot_ ||
      (!contradicts && length(*target_from_robot_) <= std::max(near_m, 0.5 * segment_length_m_));
  const bool is_near = plausible && vector.length() < max_near_vector_length;
  const bool passed = plausible && !is_near &&
                      image_difference(chain_[next_snapshot(*target_)].view, current) <
                          image_difference(chain_[*target_].view, current);
  const bool is_there_by_odometry =
      contradicts && length(*target_from_robot_) < r_m * max_near_vector_length;
  const bool skipped =
      !is_near && !passed && (is_there_by_odometry || steps_to_target_ >= max_steps_to_target_);
  if (is_near || passed) unseen_distance_m_ = 0.0;
  if (!is_near && !passed && !skipped) return false;
  // Take the heading from the compass, and the position from the vector if it is short, else from
  // odometry.
  Pose2 target_from_robot = target_from_robot_.value_or(Pose2{});
  if (is_near || !target_from_robot_) {
    target_from_robot =
        inverse(Pose2{r_m * vector.xi, r_m * vector.eta, wrap_angle(vector.heading_rad)});
  }
  aim_at_next(target_from_robot);
  return true;
}

std::optional<ChainDecision> ChainFollower::follow_odometry_if_needed(const HomeVector& vector) {
  if (!target_from_robot_) return std::nullopt;
  const bool contradicts = contradicts_odometry(vector);
  const bool near = length(*target_from_robot_) <= near_m;
  const Pose2 expected = inverse(*target_from_robot_);
  const double expected_rad = std::atan2(expected.y_m, expected.x_m);
  const double off_rad = std::abs(wrap_angle(vector.direction_rad() - expected_rad));
  const bool at_last = near && is_last(*target_);
  if (!at_last &&
      (contradicts || vector.length() == 0.0 || (!near && off_rad > max_direction_deviation_rad))) {
    return ChainDecision{ChainState::following, *target_, expected_rad,
                         std::min(pursuit_options_.max_step_m, length(expected))};
  }
  // Replace the heading by that of the compass, which does not drift.
  if (!contradicts) target_from_robot_->heading_rad = wrap_angle(-vector.heading_rad);
  return std::nullopt;
}

ChainDecision ChainFollower::decide(const HomingView& current, const Pose2& moved) {
  if (!target_) {
    start_at_most_similar_snapshot(current);
  } else if (target_from_robot_) {
    target_from_robot_ = *target_from_robot_ * moved;
    unseen_distance_m_ += length(moved);
  }
  if (pursuit_) return approach_last(current);
  HomeVector vector = home_vector(chain_[*target_].view, current);
  if (!is_last(*target_) && aim_at_next_if_reached(current, vector)) {
    vector = home_vector(chain_[*target_].view, current);
  }
  ++steps_to_target_;
  if (unseen_distance_m_ > max_unseen_distance_m) return {ChainState::lost, *target_, 0.0, 0.0};
  if (const auto decision = follow_odometry_if_needed(vector)) return *decision;
  if (is_last(*target_)) return approach_last(current);
  return {
      ChainState::following, *target_, vector.direction_rad(),
      std::min(pursuit_options_.max_step_m, pursuit_options_.typical_distance_m * vector.length())};
}

}  // namespace panonav::lab
