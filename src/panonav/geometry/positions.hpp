#pragma once

#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Where the poses are, without their headings, in their order.
[[nodiscard]] inline std::vector<Point2> positions_of(std::span<const Pose2> poses) {
  std::vector<Point2> positions;
  positions.reserve(poses.size());
  for (const Pose2& pose : poses) positions.push_back(pose.position());
  return positions;
}

}  // namespace panonav
