#include "panonav/mapping/map_measures.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

constexpr int compared_neighbours = 8;
/// Largest number of points whose neighbours are compared, as the time grows with its square; more
/// points are thinned out.
constexpr std::size_t max_neighbour_points = 2000;

// Distances of all points from one of them, which is before all others.
class DistancesFrom {
 public:
  DistancesFrom(std::span<const Point2> points, std::size_t centre) : distances_(points.size()) {
    for (std::size_t j = 0; j < points.size(); ++j) {
      distances_[j] = j == centre ? -1.0 : distance(points[centre], points[j]);
    }
  }

  /// Returns the `count` nearest points without the centre; of equally near ones the first.
  [[nodiscard]] std::vector<std::size_t> nearest(std::size_t count) const {
    std::vector<std::size_t> order(distances_.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto end = order.begin() + static_cast<std::ptrdiff_t>(count + 1);
    std::ranges::partial_sort(order, end, {},
                              [&](std::size_t j) { return std::pair(distances_[j], j); });
    return {order.begin() + 1, end};
  }

  /// Returns how many points are nearer than this one, the centre among them: its rank from 1.
  [[nodiscard]] std::size_t rank(std::size_t point) const {
    const double here = distances_[point];
    std::size_t nearer = 0;
    for (std::size_t j = 0; j < point; ++j) nearer += distances_[j] <= here ? 1 : 0;
    for (std::size_t j = point; j < distances_.size(); ++j) nearer += distances_[j] < here ? 1 : 0;
    return nearer;
  }

 private:
  std::vector<double> distances_;
};

}  // namespace

bool is_comparable(std::span<const Point2> map, std::span<const Point2> truth) {
  const auto has_extent = [](std::span<const Point2> points) {
    return std::ranges::any_of(points, [&](const Point2& p) { return p != points.front(); });
  };
  return map.size() >= 3 && truth.size() == map.size() && has_extent(map) && has_extent(truth);
}

std::optional<MapComparison> compare_positions(std::span<const Point2> map,
                                               std::span<const Point2> truth, bool allow_scale) {
  if (!is_comparable(map, truth)) return std::nullopt;
  MapComparison comparison{.compared = map.size(),
                           .shape = shape_difference(map, truth),
                           .truth_from_map = align(map, truth, {.allow_scale = allow_scale}),
                           .neighbours = {}};
  const std::size_t every = (map.size() + max_neighbour_points - 1) / max_neighbour_points;
  std::vector<Point2> thinned_map;
  std::vector<Point2> thinned_truth;
  for (std::size_t i = 0; i < map.size(); i += every) {
    thinned_map.push_back(map[i]);
    thinned_truth.push_back(truth[i]);
  }
  if (3 * compared_neighbours + 1 < 2 * static_cast<int>(thinned_map.size())) {
    comparison.neighbours = neighbour_preservation(thinned_map, thinned_truth, compared_neighbours);
  }
  return comparison;
}

MapComparison::Neighbours neighbour_preservation(std::span<const Point2> map,
                                                 std::span<const Point2> truth, int neighbours) {
  const std::size_t n = map.size();
  require(truth.size() == n, "points of the truth", static_cast<double>(truth.size()),
          "as many as of the map");
  require(neighbours >= 1 && 3 * static_cast<std::size_t>(neighbours) + 1 < 2 * n, "neighbours",
          neighbours, ">= 1 and, times 3, below twice the points less 1");
  for (const auto points : {map, truth}) {
    for (const Point2& p : points) {
      require(std::isfinite(p.x_m) && std::isfinite(p.y_m), "point", p.x_m + p.y_m, "finite");
    }
  }
  const auto k = static_cast<std::size_t>(neighbours);
  double untrue = 0.0;
  double lost = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const DistancesFrom in_map(map, i);
    const DistancesFrom in_truth(truth, i);
    const auto rank_beyond = [k](const DistancesFrom& points, std::size_t j) {
      const std::size_t rank = points.rank(j);
      return rank > k ? static_cast<double>(rank - k) : 0.0;
    };
    for (const std::size_t j : in_map.nearest(k)) untrue += rank_beyond(in_truth, j);
    for (const std::size_t j : in_truth.nearest(k)) lost += rank_beyond(in_map, j);
  }
  const double max_sum = 0.5 * static_cast<double>(n) * static_cast<double>(k) *
                         static_cast<double>(2 * n - 3 * k - 1);
  return {1.0 - untrue / max_sum, 1.0 - lost / max_sum};
}

MapComparison::Closures count_closures(const TopologicalMap& map,
                                       const std::function<std::optional<Point2>(ViewId)>& truth,
                                       double right_within_m) {
  MapComparison::Closures count;
  for (const TopologicalMap::Edge& edge : map.edges) {
    if (edge.kind != Link::Kind::closure) continue;
    const auto a = truth(edge.a);
    const auto b = truth(edge.b);
    if (!a || !b) {
      ++count.unknown;
    } else if (distance(*a, *b) <= right_within_m) {
      ++count.right;
    } else {
      ++count.wrong;
    }
  }
  return count;
}

}  // namespace panonav
