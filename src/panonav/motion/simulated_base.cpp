#include "panonav/motion/simulated_base.hpp"

#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav {

SimulatedBase::SimulatedBase(const Pose2& start, IsClear is_clear, const OdometryNoise& noise,
                             std::uint64_t seed)
    : is_clear_(std::move(is_clear)), odometry_(noise, seed), pose_(start) {}

SimulatedBase::Step SimulatedBase::drive(const Velocity& velocity, double duration_s) {
  for (const double speed : {velocity.forward_m_s, velocity.left_m_s, velocity.turn_rad_s}) {
    require(std::isfinite(speed), "velocity", speed, "finite numbers");
  }
  require(duration_s >= 0.0 && std::isfinite(duration_s), "duration_s", duration_s, ">= 0");
  Step step{.moved = motion_after(velocity, duration_s)};
  if (!is_clear_(pose_.position(), (pose_ * step.moved).position())) {
    step = {.moved = {0.0, 0.0, step.moved.heading_rad}, .stopped = true};
  }
  odometry_.advance(step.moved);
  pose_ = pose_ * step.moved;
  return step;
}

}  // namespace panonav
