#pragma once

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav::lab {

/// Proportional control of a robot with differential drive [Y03 section 5.2].
struct SteeringOptions {
  double turn_gain = 0.8;     ///< fraction of the heading error that one step corrects
  double max_turn_rad = 0.5;  ///< in one step
  double travel_gain = 0.8;   ///< fraction of the remaining distance that one step drives
  double step_m = 0.05;       ///< largest distance of one step, > 0
  /// Heading error above which the robot turns on the spot, so that it comes no nearer to obstacles
  /// than its path does.
  double on_spot_rad = 0.5;
};

/// Returns the next step towards a goal, as an odometry step [Y03 section 5.2]. The robot turns by
/// a fraction of its heading error and drives a fraction of the remaining distance, times the
/// cosine of the heading error; beyond `on_spot_rad` it only turns. Throws ContractError unless
/// step_m > 0.
[[nodiscard]] inline Pose2 steer_to(const Pose2& robot, Point2 goal,
                                    const SteeringOptions& options = {}) {
  require(options.step_m > 0.0, "step_m", options.step_m, "> 0");
  const double dx = goal.x_m - robot.x_m;
  const double dy = goal.y_m - robot.y_m;
  const double off = angle_difference(std::atan2(dy, dx), robot.heading_rad);
  const double turn =
      std::clamp(options.turn_gain * off, -options.max_turn_rad, options.max_turn_rad);
  const double travel_m =
      std::abs(off) > options.on_spot_rad
          ? 0.0
          : std::min(options.step_m, options.travel_gain * std::hypot(dx, dy)) * std::cos(off);
  // Without wheel slip the chord of the step points along the heading at half the turn.
  return {travel_m * std::cos(0.5 * turn), travel_m * std::sin(0.5 * turn), turn};
}

}  // namespace panonav::lab
