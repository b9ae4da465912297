#include "panonav/mapping/lattice_graph.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "panonav/core/disjoint_sets.hpp"
#include "panonav/core/error.hpp"

namespace panonav {

LatticeGraph::LatticeGraph(std::size_t nodes, std::span<const GraphEdge> edges)
    : begins_(nodes + 1) {
  for (const GraphEdge& edge : edges) {
    require(edge.a < nodes && edge.b < nodes, "node of an edge",
            static_cast<double>(std::max(edge.a, edge.b)), "below the number of nodes");
    require(edge.length >= 0.0, "length of an edge", edge.length, ">= 0");
    ++begins_[edge.a + 1];
    ++begins_[edge.b + 1];
  }
  std::partial_sum(begins_.begin(), begins_.end(), begins_.begin());
  neighbours_.resize(begins_.back());
  std::vector<std::size_t> next(begins_.begin(), begins_.end() - 1);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    neighbours_[next[edges[e].a]++] = {edges[e].b, e, edges[e].length};
    neighbours_[next[edges[e].b]++] = {edges[e].a, e, edges[e].length};
  }
}

std::vector<std::size_t> LatticeGraph::components() const {
  DisjointSets sets(size());
  for (std::size_t node = 0; node < size(); ++node) {
    for (const Neighbour& neighbour : neighbours(node)) sets.join(node, neighbour.node);
  }
  std::vector<std::size_t> found = sets.numbered();
  std::vector<std::size_t> sizes;
  for (const std::size_t component : found) {
    sizes.resize(std::max(sizes.size(), component + 1));
    ++sizes[component];
  }
  std::vector<std::size_t> order(sizes.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, [&](auto a, auto b) { return sizes[a] > sizes[b]; });
  std::vector<std::size_t> number(sizes.size());
  for (std::size_t i = 0; i < order.size(); ++i) number[order[i]] = i;
  for (std::size_t& component : found) component = number[component];
  return found;
}

std::vector<double> LatticeGraph::shortest_ways(std::size_t from) const {
  std::vector<double> ways(size(), std::numeric_limits<double>::infinity());
  using Open = std::pair<double, std::size_t>;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  ways.at(from) = 0.0;
  open.emplace(0.0, from);
  while (!open.empty()) {
    const auto [way, node] = open.top();
    open.pop();
    if (way > ways[node]) continue;
    for (const Neighbour& neighbour : neighbours(node)) {
      const double longer = way + neighbour.length;
      if (longer < ways[neighbour.node]) {
        ways[neighbour.node] = longer;
        open.emplace(longer, neighbour.node);
      }
    }
  }
  return ways;
}

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
  for (std::size_t place = 0; place < order.size(); ++place) {
    const std::size_t here = order[place];
    best.clear();
    // False once points that way are farther along x than the farthest of the best.
    const auto look = [&](std::size_t other) {
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
      left = left && step <= place && look(order[place - step]);
      right = right && place + step < order.size() && look(order[place + step]);
    }
    for (const auto& [unused, other] : best) result[here].push_back(other);
  }
  return result;
}

}  // namespace panonav
