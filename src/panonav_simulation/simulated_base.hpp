#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/motion/velocity.hpp"
#include "panonav_simulation/simulated_odometry.hpp"

namespace panonav::simulation {

/// A robot base that drives as commanded until an obstacle blocks it, with the odometry of its
/// wheels.
class SimulatedBase {
 public:
  /// Returns true if the straight line is free of obstacles.
  using IsClear = std::function<bool(Point2 from, Point2 to)>;
  /// The true motion of one command.
  struct Step {
    Pose2 moved;           ///< robot_old_from_robot_new
    bool stopped = false;  ///< by an obstacle
  };

  /// Throws OptionError.
  SimulatedBase(const Pose2& start, IsClear is_clear, const OdometryNoise& noise,
                std::uint64_t seed)
      : is_clear_(std::move(is_clear)), odometry_(noise, seed), pose_(start) {}

  /// Drives at constant velocity for a time. If an obstacle blocks the path, the robot turns but
  /// does not move. Throws ContractError unless the numbers are finite and the time is >= 0.
  Step drive(const Velocity& velocity, double duration_s) {
    for (const double speed : {velocity.forward_m_s, velocity.left_m_s, velocity.turn_rad_s}) {
      require(std::isfinite(speed), "velocity", speed, "finite numbers");
    }
    require(duration_s >= 0.0 && std::isfinite(duration_s), "duration_s", duration_s, ">= 0");
    Step step{.moved = integrate_velocity(velocity, duration_s)};
    if (!is_clear_(pose_.position(), (pose_ * step.moved).position())) {
      step = {.moved = {0.0, 0.0, step.moved.heading_rad}, .stopped = true};
    }
    odometry_.advance(step.moved);
    pose_ = pose_ * step.moved;
    return step;
  }
  /// Moves the robot to `pose` without its odometry noticing, as if a person carried it.
  void teleport_to(const Pose2& pose) noexcept { pose_ = pose; }
  /// Returns the true pose, in the frame of the start pose.
  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }
  /// Returns odometry_from_robot as measured by the wheels, identity at the start.
  [[nodiscard]] const Pose2& odometry() const noexcept { return odometry_.pose(); }

 private:
  IsClear is_clear_;
  SimulatedOdometry odometry_;
  Pose2 pose_;
};

}  // namespace panonav::simulation
