#include "panonav/geometry/nearest_points.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav {

std::vector<std::vector<std::size_t>> nearest_points(std::span<const Point2> points,
                                                     std::span<const std::size_t> group,
                                                     std::size_t count) {
  require(group.size() == points.size(), "size of group", static_cast<double>(group.size()),
          "the number of points");
  std::vector<std::vector<std::size_t>> result(points.size());
  if (count == 0) return result;
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, [&](auto a, auto b) {
    if (group[a] != group[b]) return group[a] < group[b];
    return points[a].x_m != points[b].x_m ? points[a].x_m < points[b].x_m : a < b;
  });
  std::vector<std::pair<double, std::size_t>> best;
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    const std::size_t here = order[rank];
    best.clear();
    // Inserts a point into `best` if it is near enough. False if the search in this direction can
    // stop: the group ends, or x alone differs by more than the distance of the farthest in `best`.
    const auto insert_if_near = [&](std::size_t other) {
      if (group[other] != group[here]) return false;
      const bool full = best.size() == count;
      if (full && std::abs(points[other].x_m - points[here].x_m) > best.back().first) return false;
      const std::pair candidate{distance(points[here], points[other]), other};
      if (full && !(candidate < best.back())) return true;
      best.insert(std::ranges::upper_bound(best, candidate), candidate);
      if (best.size() > count) best.pop_back();
      return true;
    };
    bool left = true;
    bool right = true;
    for (std::size_t step = 1; left || right; ++step) {
      left = left && step <= rank && insert_if_near(order[rank - step]);
      right = right && rank + step < order.size() && insert_if_near(order[rank + step]);
    }
    for (const auto& [unused, other] : best) result[here].push_back(other);
  }
  return result;
}

std::vector<double> distances_between_nearest_positions(std::span<const Point2> points,
                                                        std::span<const std::size_t> group) {
  require(group.size() == points.size(), "size of group", static_cast<double>(group.size()),
          "the number of points");
  constexpr double relative_tolerance = 1e-6;  // a millimetre in a kilometre (chosen)
  double largest = 0.0;
  for (const Point2& point : points)
    largest = std::max({largest, std::abs(point.x_m), std::abs(point.y_m)});
  const double tolerance = relative_tolerance * largest;
  if (!(tolerance > 0.0)) return {};  // all points are at 0
  std::vector<Point2> positions;
  std::vector<std::size_t> groups;
  std::set<std::tuple<std::size_t, double, double>> known;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::tuple cell{group[i], std::round(points[i].x_m / tolerance),
                          std::round(points[i].y_m / tolerance)};
    if (!known.insert(cell).second) continue;
    positions.push_back(points[i]);
    groups.push_back(group[i]);
  }
  const auto nearest = nearest_points(positions, groups, 1);
  std::vector<double> distances;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (nearest[i].empty()) continue;
    const double apart = distance(positions[i], positions[nearest[i].front()]);
    // Points of one position may lie on both sides of a border between cells.
    if (apart > tolerance) distances.push_back(apart);
  }
  return distances;
}

}  // namespace panonav
