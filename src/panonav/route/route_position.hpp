#pragma once

#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Where a robot is as seen from a route.
struct RoutePosition {
  double along_m = 0.0;    ///< way along the path to its place nearest to the robot
  double lateral_m = 0.0;  ///< from there to the robot; positive to the left of the path
};

// Of a way through the positions of `path`, which must not be empty. They throw nothing. Cost:
// O(path).

/// The place of `position` beside the path. Places of a path of one pose are at 0 along it.
[[nodiscard]] RoutePosition project_onto_route(std::span<const Pose2> path, Point2 position);

/// All places where the path passes `position` within `reach_m`, ascending along it: the nearest
/// one of each stretch that is so near. Empty on a path of one pose.
[[nodiscard]] std::vector<RoutePosition> find_passes(std::span<const Pose2> path, Point2 position,
                                                     double reach_m);

/// Where the path is `along_m` from its start; before its start and beyond its end these.
[[nodiscard]] Point2 point_on_route(std::span<const Pose2> path, double along_m);

/// The path between two ways along it, both ends included; back when it begins at the greater one.
[[nodiscard]] std::vector<Point2> route_segment(std::span<const Pose2> path, double from_m,
                                                double to_m);

}  // namespace panonav
