#pragma once

#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Computes the length of the polyline through the positions; 0 for fewer than two.
[[nodiscard]] double path_length_m(std::span<const Pose2> path);
/// Returns the length of a path of positions.
[[nodiscard]] double path_length_m(std::span<const Point2> path);

/// Estimates the heading at each position of a path that a robot drove forwards: the direction of
/// the least-squares line through the positions within the path length `window_m` on both sides,
/// but at least the neighbours. A tracker's position error of about 1 cm causes an error of about a
/// degree over 0.6 m. Throws ContractError unless window_m >= 0. Cost: O(positions within the
/// window) for each.
[[nodiscard]] std::vector<Pose2> estimate_headings(std::span<const Point2> positions,
                                                   double window_m = 0.3);

}  // namespace panonav
