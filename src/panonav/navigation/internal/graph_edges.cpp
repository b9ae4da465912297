#include "panonav/navigation/internal/graph_edges.hpp"

#include <algorithm>
#include <set>

#include "panonav/core/statistics.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

namespace {

/// Smallest length of an edge relative to the median: used between images of one place.
constexpr double min_length_share = 0.1;

// Computes a batch of edges from the phases of their views, which are all loaded at once.
void read_edge_batch(const ViewSource& source, std::span<const Link> links,
                     std::span<NavigationGraph::Edge> edges, Executor& executor) {
  std::set<ViewId> ids;
  for (const Link& link : links) ids.insert({link.a, link.b});
  const VisualMemory memory = source.load(std::vector<ViewId>(ids.begin(), ids.end()));
  constexpr std::size_t links_per_chunk = 64;
  executor.for_each_chunk(
      links.size(), links_per_chunk, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t i = begin; i < end; ++i) {
          edges[i] = {links[i].a, links[i].b, 0.0, std::nullopt};
          const auto reading = read_phases(homing_view(memory.signature(links[i].a)),
                                           homing_view(memory.signature(links[i].b)));
          if (!reading) continue;
          edges[i].a_from_b = to_motion(*reading);
          if (edges[i].a_from_b) edges[i].length = reading->length;
        }
      });
}

}  // namespace

std::optional<Pose2> to_motion(const PhaseReading& reading) {
  if (reading.has_direction && reading.disagreement_rad > max_disagreement_rad) return std::nullopt;
  return reading.a_from_b();
}

void fill_missing_lengths(std::vector<NavigationGraph::Edge>& edges) {
  std::vector<double> lengths;
  for (const NavigationGraph::Edge& edge : edges) {
    if (edge.length > 0.0) lengths.push_back(edge.length);
  }
  const double typical = lengths.empty() ? 1.0 : upper_median(lengths);
  for (NavigationGraph::Edge& edge : edges) {
    const bool is_known = edge.a_from_b || edge.length > 0.0;
    edge.length = is_known ? std::max(edge.length, min_length_share * typical)
                           : unknown_length_share * typical;
  }
}

std::vector<NavigationGraph::Edge> read_edges(const ViewSource& source, std::span<const Link> links,
                                              Executor& executor) {
  std::vector<NavigationGraph::Edge> edges(links.size());
  constexpr std::size_t links_at_once = 2048;
  for (std::size_t first = 0; first < links.size(); first += links_at_once) {
    const std::size_t count = std::min(links_at_once, links.size() - first);
    read_edge_batch(source, links.subspan(first, count), std::span(edges).subspan(first, count),
                    executor);
  }
  return edges;
}

}  // namespace panonav
