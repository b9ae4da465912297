#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// The point where the line of sight in one direction crosses the recorded path.
struct RouteCrossing {
  float along = -1.0F;      ///< index of the line, with its fraction; below 0: none
  float distance_m = 0.0F;  ///< from the viewpoint, positive ahead of it and negative behind
  float along_by_x = 0.0F;  ///< change of `along` with the viewpoint, per metre
  float along_by_y = 0.0F;  ///< the same along y
};

/// A direction in the plane, of unit length.
struct Direction2 {
  double x = 1.0;  ///< along the x axis
  double y = 0.0;  ///< along the y axis
};

/// Returns `count` directions, equally spaced from the x axis counter-clockwise.
[[nodiscard]] std::vector<Direction2> equal_directions(std::size_t count);

/// Finds for each of `directions`, which must be those of `equal_directions`, where the line of
/// sight through `viewpoint` crosses the path next to it [Y03 eq. 5, for paths of any shape]. The
/// image recorded at a crossing shows the line of sight; at the nearest crossing the fewest objects
/// are in between. `path`: poses of the lines from `first` on. Throws nothing. Cost:
/// O(path + directions).
void find_crossings(std::span<const Pose2> path, std::size_t first, Point2 viewpoint,
                    std::span<const Direction2> directions, std::span<RouteCrossing> crossings);

}  // namespace panonav
