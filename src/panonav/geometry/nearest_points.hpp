#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Finds, for each point, the indices of the `count` nearest other points of the same group
/// (`group[i]` is the group of point i), nearest first, ties by index. Cost: O(n sqrt(n) count) for
/// n points spread over a square.
[[nodiscard]] std::vector<std::vector<std::size_t>> nearest_points(
    std::span<const Point2> points, std::span<const std::size_t> group, std::size_t count);

/// Returns, for each position of a group, its distance from the nearest other one, in no order.
/// Several points at one position count once: those that differ by no more than 1e-6 of the largest
/// coordinate, as a solver leaves between equal views that springs hold together. Throws and costs
/// as `nearest_points`.
[[nodiscard]] std::vector<double> distances_between_nearest_positions(
    std::span<const Point2> points, std::span<const std::size_t> group);

}  // namespace panonav
