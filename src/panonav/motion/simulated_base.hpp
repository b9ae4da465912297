#pragma once

#include <cstdint>
#include <functional>

#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/motion/velocity.hpp"

namespace panonav {

/// A robot base that does what it is told until something is in its way, and the odometry that its
/// wheels tell.
class SimulatedBase {
 public:
  /// Whether nothing stands on the straight way.
  using IsClear = std::function<bool(Point2 from, Point2 to)>;
  /// What truly happened.
  struct Step {
    Pose2 moved;           ///< robot_old_from_robot_new
    bool stopped = false;  ///< by something in its way
  };

  /// Throws OptionError.
  SimulatedBase(const Pose2& start, IsClear is_clear, const OdometryNoise& noise,
                std::uint64_t seed);

  /// Where something is in its way it turns, but does not move. Throws ContractError unless the
  /// numbers are finite and the time is >= 0.
  Step drive(const Velocity& velocity, double duration_s);
  /// Somebody carries it there; its odometry does not know.
  void carry_to(const Pose2& pose) noexcept { pose_ = pose; }

  /// Where the robot truly is, in the frame of the start pose.
  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }
  /// Where its wheels say that it is: odometry_from_robot, zero at the start.
  [[nodiscard]] const Pose2& odometry() const noexcept { return odometry_.pose(); }

 private:
  IsClear is_clear_;
  SimulatedOdometry odometry_;
  Pose2 pose_;
};

}  // namespace panonav
