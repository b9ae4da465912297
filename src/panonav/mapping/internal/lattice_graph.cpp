#include "panonav/mapping/internal/lattice_graph.hpp"

#include <algorithm>
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
  std::vector<std::size_t> found = sets.number_sets();
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

std::vector<double> LatticeGraph::shortest_path_lengths(std::size_t from) const {
  std::vector<double> lengths(size(), std::numeric_limits<double>::infinity());
  using Open = std::pair<double, std::size_t>;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  lengths.at(from) = 0.0;
  open.emplace(0.0, from);
  while (!open.empty()) {
    const auto [length, node] = open.top();
    open.pop();
    if (length > lengths[node]) continue;
    for (const Neighbour& neighbour : neighbours(node)) {
      const double longer = length + neighbour.length;
      if (longer < lengths[neighbour.node]) {
        lengths[neighbour.node] = longer;
        open.emplace(longer, neighbour.node);
      }
    }
  }
  return lengths;
}

}  // namespace panonav
