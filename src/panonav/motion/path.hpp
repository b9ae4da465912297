#pragma once

#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Length of the polyline through the positions; 0 for fewer than two.
[[nodiscard]] double path_length_m(std::span<const Pose2> path);
/// Returns the length of a path of positions.
[[nodiscard]] double path_length_m(std::span<const Point2> path);

/// Adds headings along the path to positions, for a robot that drove forwards through them. Each
/// heading is the direction of the least-squares line through the positions within `window_m` of
/// path to either side, at least the neighbours. Positions of a tracker scatter by about a
/// centimetre, which is a degree over 0.6 m. Throws ContractError unless window_m >= 0. Cost:
/// O(positions within the window) for each.
[[nodiscard]] std::vector<Pose2> estimate_headings(std::span<const Point2> positions,
                                                   double window_m = 0.3);

}  // namespace panonav
