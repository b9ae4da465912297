#pragma once

#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Positions with headings along the way, for a robot that drove forwards through them: at each the
/// direction of the line that fits those within `reach_m` of way to either side in least squares,
/// at least the neighbours. Positions of a tracker scatter by a centimetre or so; over 0.6 m that
/// is a degree. Throws ContractError unless reach_m >= 0. Cost: O(positions within reach).
[[nodiscard]] std::vector<Pose2> headed_along_way(std::span<const Point2> positions,
                                                  double reach_m = 0.3);

}  // namespace panonav
