#include "panonav/homing/chain_follower.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

double length(const Pose2& step) {
  return std::hypot(step.x_m, step.y_m);
}

}  // namespace

void visit_options(ChainFollowerOptions& options, OptionVisitor& visitor) {
  using T = ChainFollowerOptions;
  constexpr OptionTable table{
      option<&T::switch_length>(
          "the next snapshot is homed to where the vector is shorter, in units of R", 0, 1),
      option<&T::mistrust_rad>("vectors farther from what odometry expects are not followed", 0,
                               std::numbers::pi),
      option<&T::mistrust_heading_rad>(
          "headings farther from what odometry expects are not believed", 0, std::numbers::pi),
      option<&T::near_m>("nearer to the expected place vectors are always followed", 0, 1000),
      option<&T::longest_unseen_m>(
          "the robot is lost after so long a way without reaching a snapshot", 0, 1e6),
  };
  table.visit(options, visitor);
}

ChainFollower::ChainFollower(SnapshotChain chain, ChainDirection direction,
                             const ChainFollowerOptions& options,
                             const HomingPursuitOptions& pursuit,
                             const FourierHomingOptions& vector)
    : chain_(std::move(chain)),
      direction_(direction),
      options_(options),
      pursuit_options_(pursuit),
      vector_(vector) {
  validate(chain_);
  validate(options_);
  validate(pursuit_options_);
  validate(vector_);
}

bool ChainFollower::is_last(std::size_t target) const noexcept {
  return direction_ == ChainDirection::forward ? target + 1 == chain_.snapshots.size()
                                               : target == 0;
}

std::size_t ChainFollower::next(std::size_t target) const noexcept {
  return direction_ == ChainDirection::forward ? target + 1 : target - 1;
}

Pose2 ChainFollower::target_from_next() const {
  return direction_ == ChainDirection::forward
             ? chain_.snapshots[*target_ + 1].previous_from_this
             : inverse(chain_.snapshots[*target_].previous_from_this);
}

void ChainFollower::aim_at_next(const Pose2& target_from_robot) {
  target_from_robot_ = inverse(target_from_next()) * target_from_robot;
  target_ = next(*target_);
  steps_to_target_ = 0;
  way_m_ = length(*target_from_robot_);
  max_steps_to_target_ = 3 + 3 * static_cast<int>(std::ceil(way_m_ / pursuit_options_.max_step_m));
}

bool ChainFollower::contradicts_odometry(const HomeVector& vector) const noexcept {
  if (!target_from_robot_) return false;
  const double drift_rad = wrap_angle(-vector.heading_rad - target_from_robot_->heading_rad);
  return std::abs(drift_rad) > options_.mistrust_heading_rad;
}

ChainDecision ChainFollower::approach_last(const HomingView& current) {
  if (!pursuit_) pursuit_.emplace(view(*target_), pursuit_options_, vector_);
  const PursuitDecision step = pursuit_->decide(current);
  ChainDecision decision;
  decision.target = *target_;
  decision.vector = step.vector;
  decision.turn_rad = step.turn_rad;
  decision.advance_m = step.advance_m;
  if (step.state == PursuitState::arrived) decision.state = ChainState::finished;
  if (step.state == PursuitState::wrong_place || step.state == PursuitState::exhausted) {
    decision.state = ChainState::lost;
  }
  return decision;
}

ChainDecision ChainFollower::decide(const HomingView& current, const Pose2& moved) {
  if (!target_) {
    std::size_t best = 0;
    double least = 3.0;
    for (std::size_t i = 0; i < chain_.snapshots.size(); ++i) {
      const double difference = image_difference(view(i), current);
      if (difference < least) {
        least = difference;
        best = i;
      }
    }
    target_ = best;
    max_steps_to_target_ = pursuit_options_.max_steps;
  } else if (target_from_robot_) {
    target_from_robot_ = *target_from_robot_ * moved;
    unseen_m_ += length(moved);
  }
  if (pursuit_) return approach_last(current);

  HomeVector vector = home_vector(view(*target_), current, vector_);
  if (!is_last(*target_)) {
    // What the views say counts where odometry does not exclude it.
    const bool contradicts = contradicts_odometry(vector);
    const bool plausible =
        !target_from_robot_ ||
        (!contradicts && length(*target_from_robot_) <= std::max(options_.near_m, 0.5 * way_m_));
    const bool is_near = plausible && vector.length() < options_.switch_length;
    const bool passed =
        plausible && !is_near &&
        image_difference(view(next(*target_)), current) < image_difference(view(*target_), current);
    const bool is_there_by_odometry =
        contradicts &&
        length(*target_from_robot_) < pursuit_options_.typical_distance_m * options_.switch_length;
    const bool given_up =
        !is_near && !passed && (is_there_by_odometry || steps_to_target_ >= max_steps_to_target_);
    if (is_near || passed) unseen_m_ = 0.0;
    if (is_near || passed || given_up) {
      // Heading by the compass. Position by the vector where it is short, else by odometry.
      Pose2 target_from_robot = target_from_robot_.value_or(Pose2{});
      if (is_near || !target_from_robot_) {
        const double r_m = pursuit_options_.typical_distance_m;
        target_from_robot =
            inverse(Pose2{r_m * vector.xi, r_m * vector.eta, wrap_angle(vector.heading_rad)});
      }
      aim_at_next(target_from_robot);
      vector = home_vector(view(*target_), current, vector_);
    }
  }
  ++steps_to_target_;

  ChainDecision decision;
  decision.target = *target_;
  decision.vector = vector;
  if (unseen_m_ > options_.longest_unseen_m) {
    decision.state = ChainState::lost;
    return decision;
  }
  if (target_from_robot_) {
    const bool contradicts = contradicts_odometry(vector);
    const bool near = length(*target_from_robot_) <= options_.near_m;
    const Pose2 expected = inverse(*target_from_robot_);
    const double expected_rad = std::atan2(expected.y_m, expected.x_m);
    const double off_rad = std::abs(wrap_angle(vector.direction_rad() - expected_rad));
    const bool at_last = near && is_last(*target_);
    if (!at_last &&
        (contradicts || vector.length() == 0.0 || (!near && off_rad > options_.mistrust_rad))) {
      decision.by_odometry = true;
      decision.turn_rad = expected_rad;
      decision.advance_m = std::min(pursuit_options_.max_step_m, length(expected));
      return decision;
    }
    // The compass does not drift.
    if (!contradicts) target_from_robot_->heading_rad = wrap_angle(-vector.heading_rad);
  }
  if (is_last(*target_)) return approach_last(current);
  decision.turn_rad = vector.direction_rad();
  decision.advance_m =
      std::min(pursuit_options_.max_step_m, pursuit_options_.typical_distance_m * vector.length());
  return decision;
}

}  // namespace panonav
