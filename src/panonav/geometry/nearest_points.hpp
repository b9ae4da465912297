#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Finds for each of `points` the `count` nearest other ones, nearest first, ties by index. Points
/// that are not in the same `group` do not count. Cost: n sqrt(n) count for points in a square.
[[nodiscard]] std::vector<std::vector<std::size_t>> nearest_points(
    std::span<const Point2> points, std::span<const std::size_t> group, std::size_t count);

}  // namespace panonav
