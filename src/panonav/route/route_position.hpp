#pragma once

#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// A position relative to a route.
struct RoutePosition {
  double along_m = 0.0;    ///< path length to the point of the route nearest to the position
  double lateral_m = 0.0;  ///< offset from there; positive to the left of the route
};

// The functions below need a path of at least one pose and throw nothing. Cost: O(path).

/// Projects a position onto a path. On a path of one pose `along_m` is 0.
[[nodiscard]] RoutePosition project_onto_route(std::span<const Pose2> path, Point2 position);

/// Returns the passes of the path within `reach_m` of a position in the order of the path: for each
/// section of the path within reach its point nearest to the position. None for a path of one pose.
[[nodiscard]] std::vector<RoutePosition> find_passes(std::span<const Pose2> path, Point2 position,
                                                     double reach_m);

/// Returns the point of the path at `along_m` from its start, limited to its two ends.
[[nodiscard]] Point2 point_on_route(std::span<const Pose2> path, double along_m);

/// Returns the path between two distances along it, both ends included; in reverse when it begins
/// at the larger one.
[[nodiscard]] std::vector<Point2> route_segment(std::span<const Pose2> path, double from_m,
                                                double to_m);

}  // namespace panonav
