#pragma once

#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Positions with headings along the path, for a robot that drove forwards through them. Each
/// heading is the direction of the least-squares line through the positions within `reach_m` of
/// path to either side, at least the neighbours. Positions of a tracker scatter by about a
/// centimetre, which is a degree over 0.6 m. Throws ContractError unless reach_m >= 0. Cost:
/// O(positions within reach).
[[nodiscard]] std::vector<Pose2> headed_along_way(std::span<const Point2> positions,
                                                  double reach_m = 0.3);

}  // namespace panonav
