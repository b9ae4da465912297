#pragma once

#include <span>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Where a robot is as seen from a route.
struct RoutePlace {
  double along_m = 0.0;    ///< way along the path to its place nearest to the robot
  double lateral_m = 0.0;  ///< from there to the robot; positive to the left of the path
};

/// The place of `position` beside the way through the positions of `path`. Places of a path of one
/// pose are at 0 along it. Cost: O(path). Throws nothing; `path` must not be empty.
[[nodiscard]] RoutePlace place_on_route(std::span<const Pose2> path, Point2 position);

}  // namespace panonav
