#pragma once

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav::lab {

/// Proportional control of a robot with differential drive [Y03 section 5.2].
struct SteeringOptions {
  double turn_gain = 0.8;     ///< share of the heading error turned in one step
  double max_turn_rad = 0.5;  ///< in one step
  double travel_gain = 0.8;   ///< share of the remaining distance driven in one step
  double step_m = 0.05;       ///< longest step, > 0
  /// With a larger heading error the robot turns on the spot. It then comes no nearer to obstacles
  /// along its path than the path does.
  double on_spot_rad = 0.5;
};

/// Returns the next step towards a goal, as an odometry step [Y03 section 5.2]. The robot turns by
/// a share of its heading error and drives a share of the remaining distance. It drives less the
/// farther the goal is off to the side, and not at all beyond `on_spot_rad`. Throws ContractError
/// unless step_m > 0.
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
  // Wheels without slip: the chord of the step points along the heading at its middle.
  return {travel_m * std::cos(0.5 * turn), travel_m * std::sin(0.5 * turn), turn};
}

}  // namespace panonav::lab
