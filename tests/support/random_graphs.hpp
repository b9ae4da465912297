#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/navigation/navigation_graph.hpp"

namespace panonav::testing {

/// Views 10, 13, 16, ..: ids are not places.
inline std::vector<ViewId> numbered_views(std::size_t count) {
  std::vector<ViewId> views;
  for (std::size_t i = 0; i < count; ++i) {
    views.push_back(ViewId{static_cast<std::uint32_t>(10 + 3 * i)});
  }
  return views;
}

/// Edges at random, connected or not.
inline NavigationGraph random_graph(std::size_t nodes, std::size_t edges, std::uint64_t seed) {
  Random random(seed);
  const auto views = numbered_views(nodes);
  std::vector<NavigationGraph::Edge> made;
  for (std::size_t i = 0; i < edges; ++i) {
    const std::size_t a = random.index(nodes);
    const std::size_t b = random.index(nodes);
    if (a != b) made.push_back({views[a], views[b], random.uniform(0.1, 2.0), std::nullopt});
  }
  return {views, made};
}

/// Views with poses and an edge between all that are no farther apart than `reach_m` and see
/// each other, as `sees` says.
template <class Sees>
NavigationGraph posed_graph(const std::vector<Pose2>& poses, double reach_m, const Sees& sees) {
  const auto views = numbered_views(poses.size());
  std::vector<NavigationGraph::Edge> made;
  for (std::size_t a = 0; a < poses.size(); ++a) {
    for (std::size_t b = a + 1; b < poses.size(); ++b) {
      const double length = distance(poses[a].position(), poses[b].position());
      if (length > reach_m || !sees(poses[a].position(), poses[b].position())) continue;
      made.push_back({views[a], views[b], length, inverse(poses[a]) * poses[b]});
    }
  }
  return {views, made};
}

/// Lengths of the shortest paths between all nodes (Floyd and Warshall), by index a * size + b.
inline std::vector<double> compute_all_path_lengths(const NavigationGraph& graph,
                                                    const std::vector<std::uint8_t>& closed = {}) {
  const std::size_t n = graph.size();
  std::vector<double> path_lengths(n * n, std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < n; ++i) path_lengths[i * n + i] = 0.0;
  for (std::size_t p = 0; p < graph.edges().size(); ++p) {
    if (!closed.empty() && closed[p] != 0) continue;
    const NavigationGraph::Edge& edge = graph.edges()[p];
    const std::size_t a = *graph.node_of(edge.a);
    const std::size_t b = *graph.node_of(edge.b);
    path_lengths[a * n + b] = std::min(path_lengths[a * n + b], edge.length);
    path_lengths[b * n + a] = path_lengths[a * n + b];
  }
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        path_lengths[i * n + j] =
            std::min(path_lengths[i * n + j], path_lengths[i * n + k] + path_lengths[k * n + j]);
      }
    }
  }
  return path_lengths;
}

}  // namespace panonav::testing
