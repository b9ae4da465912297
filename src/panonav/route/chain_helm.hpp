#pragma once

#include <optional>

#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/velocity.hpp"
#include "panonav/route/chain_pilot.hpp"

namespace panonav {

/// Carries out the motions that a `ChainPilot` or `ChainFollower` decides, by odometry, as
/// velocities; without heap memory and exceptions, with the same bits on a microcontroller.
class ChainHelm {
 public:
  /// The caller guarantees options in their ranges.
  explicit ChainHelm(const BaseOptions& base = {}) noexcept : base_(base) {}

  /// True if the present motion is over, so that the next one must be decided at this pose by
  /// odometry.
  [[nodiscard]] bool needs_decision(const Pose2& odometry) const noexcept;
  /// Begins a motion at a pose by odometry.
  void begin(const ChainDecision& decision, const Pose2& odometry) noexcept;
  /// Returns the motion of the robot since the last decision, for the next one.
  [[nodiscard]] Pose2 moved_to(const Pose2& odometry) const noexcept;

  /// The last decision; nullopt before the first one.
  [[nodiscard]] const std::optional<ChainDecision>& decision() const noexcept { return decision_; }
  /// True if the robot has arrived or is lost.
  [[nodiscard]] bool is_over() const noexcept;
  /// Length of the present motion that is left; 0 without a motion.
  [[nodiscard]] double remaining_m(const Pose2& odometry) const noexcept;
  /// Returns the velocity for the next period; 0 without a motion.
  [[nodiscard]] Velocity velocity(const Pose2& odometry) const noexcept;

 private:
  [[nodiscard]] Point2 target_from(const Pose2& odometry) const noexcept;

  BaseOptions base_;
  std::optional<ChainDecision> decision_;
  Pose2 decided_at_;
};

}  // namespace panonav
