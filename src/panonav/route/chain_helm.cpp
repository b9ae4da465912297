#include "panonav/route/chain_helm.hpp"

#include "panonav/core/portable_math.hpp"
#include "panonav/motion/command.hpp"
#include "panonav/route/internal/portable_pose.hpp"

namespace panonav {

bool ChainHelm::is_over() const noexcept {
  return decision_ &&
         (decision_->state == ChainState::arrived || decision_->state == ChainState::lost);
}

// Returns the end of the present motion in the robot frame.
Point2 ChainHelm::target_from(const Pose2& odometry) const noexcept {
  if (!decision_ || is_over()) return {};
  const auto [cosine, sine] = portable::cosine_sine(decision_->turn_rad);
  return transform_back(odometry, transform(decided_at_, {decision_->advance_m * cosine,
                                                          decision_->advance_m * sine}));
}

bool ChainHelm::needs_decision(const Pose2& odometry) const noexcept {
  // A motion ends when this part of it is left: the next decision is by an image, and corrects it.
  constexpr double left_part = 0.05;
  if (!decision_) return true;
  return !is_over() && remaining_m(odometry) <= left_part * decision_->advance_m;
}

void ChainHelm::begin(const ChainDecision& decision, const Pose2& odometry) noexcept {
  decision_ = decision;
  decided_at_ = odometry;
}

Pose2 ChainHelm::moved_to(const Pose2& odometry) const noexcept {
  if (!decision_) return {};
  const Point2 place = transform_back(decided_at_, odometry.position());
  return {place.x_m, place.y_m, wrap_angle(odometry.heading_rad - decided_at_.heading_rad)};
}

double ChainHelm::remaining_m(const Pose2& odometry) const noexcept {
  return portable_distance(target_from(odometry), {});
}

Velocity ChainHelm::velocity(const Pose2& odometry) const noexcept {
  const Point2 ahead = target_from(odometry);
  return command_towards(portable::atan2(ahead.y_m, ahead.x_m), remaining_m(odometry), base_);
}

}  // namespace panonav
