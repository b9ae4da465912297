#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/route/route_tracker.hpp"

namespace panonav {

struct RouteLegOptions {
  double reach_m = 0.4;     ///< robot and goal lie no farther beside the route
  double shortest_m = 0.5;  ///< of the way along the route; nearer goals are left to homing
};
void visit_options(RouteLegOptions& options, OptionVisitor& visitor);

/// A part of a recorded route that leads from a robot to its goal.
struct RouteLeg {
  /// From the robot's place on the route to the goal, in the route's frame; for a `PathFollower`.
  std::vector<Point2> path;
  Pose2 route_from_robot;  ///< where the robot is; for `RouteTracker::set_pose`
  double length_m = 0.0;   ///< of the way along the route
  bool back = false;       ///< against the direction in which it was recorded
};

/// Whether a recorded route leads from where the line `here` was seen to where the line `goal` was,
/// in either direction. Both are looked for on the whole route; empty unless both are found within
/// reach and lie far enough apart. To drive the leg, give its pose to a tracker of the route and
/// its path to a `PathFollower`: line in, pose out, step out, and `velocity_for` makes a command of
/// it. Throws ContractError on a line of another length, OptionError. Cost: two searches.
[[nodiscard]] std::optional<RouteLeg> route_leg(const RouteTracker& tracker,
                                                std::span<const float> here,
                                                std::span<const float> goal,
                                                const RouteLegOptions& options = {});

}  // namespace panonav
