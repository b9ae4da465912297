#include "panonav/navigation/navigation_graph.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/navigation/internal/graph_edges.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

namespace {

void require_valid(const NavigationGraph::Edge& edge) {
  require(edge.a != edge.b, "view of an edge", static_cast<double>(edge.a.value),
          "two different views");
  require(std::isfinite(edge.length) && edge.length > 0.0, "length of an edge", edge.length,
          "> 0 and finite");
  if (edge.a_from_b && !is_finite(*edge.a_from_b)) {
    throw ContractError("motion of an edge", "not finite", "finite");
  }
}

/// Largest assumed error of the map's relative heading of two views: about 30 degrees, less than
/// half of the quarter rotation after which rooms look similar.
constexpr float max_heading_error_rad = 0.5F;

bool is_similar_motion(const Pose2& a, const Pose2& b) {
  const double turned = angle_difference(a.heading_rad, b.heading_rad);
  const double aside = angle_difference(std::atan2(a.y_m, a.x_m), std::atan2(b.y_m, b.x_m));
  return std::abs(turned) <= max_disagreement_rad && std::abs(aside) <= max_disagreement_rad;
}

// True if most triangles with a third view confirm the motion of the edge, as in `arrange`, or if
// there is no triangle; false if no triangle has known motions.
bool is_supported(const NavigationGraph& graph, const NavigationGraph::Edge& edge) {
  const std::size_t a = *graph.node_of(edge.a);
  const std::size_t b = *graph.node_of(edge.b);
  int triangles = 0;
  int readable = 0;
  int closed = 0;
  for (const NavigationGraph::Exit& first : graph.exits(a)) {
    const auto exits = graph.exits(first.node);
    const auto second = std::ranges::lower_bound(exits, b, {}, &NavigationGraph::Exit::node);
    if (second == exits.end() || second->node != b) continue;
    ++triangles;
    const auto a_from_c = graph.motion_from(a, first.edge);
    const auto c_from_b = graph.motion_from(first.node, second->edge);
    if (!a_from_c || !c_from_b) continue;
    ++readable;
    closed += static_cast<int>(is_similar_motion(*edge.a_from_b, *a_from_c * *c_from_b));
  }
  return triangles == 0 || 2 * closed > readable;
}

}  // namespace

NavigationGraph::NavigationGraph(std::vector<ViewId> views,
                                 std::vector<NavigationGraph::Edge> edges)
    : views_(std::move(views)), exit_begins_(views_.size() + 1) {
  for (std::size_t i = 1; i < views_.size(); ++i) {
    require(views_[i - 1] < views_[i], "views", static_cast<double>(views_[i].value), "ascending");
  }
  struct Ends {
    std::size_t low, high, edge;
  };
  std::vector<Ends> ends;
  for (const NavigationGraph::Edge& edge : edges) {
    require_valid(edge);
    const auto a = node_of(edge.a);
    const auto b = node_of(edge.b);
    require(a && b, "view of an edge", static_cast<double>((a ? edge.b : edge.a).value),
            "a view of the graph");
    ends.push_back({std::min(*a, *b), std::max(*a, *b), ends.size()});
  }
  std::ranges::sort(ends, {}, [](const Ends& e) { return std::tuple(e.low, e.high, e.edge); });
  ends.erase(
      std::unique(ends.begin(), ends.end(),
                  [](const Ends& x, const Ends& y) { return x.low == y.low && x.high == y.high; }),
      ends.end());
  for (const Ends& e : ends) {
    ++exit_begins_[e.low + 1];
    ++exit_begins_[e.high + 1];
  }
  std::partial_sum(exit_begins_.begin(), exit_begins_.end(), exit_begins_.begin());
  exits_.resize(exit_begins_.back());
  std::vector<std::size_t> next(exit_begins_.begin(), exit_begins_.end() - 1);
  // Fills exits to lower nodes first and those to higher nodes last, so that the exits of each node
  // ascend.
  for (const Ends& e : ends) {
    exits_[next[e.high]++] = {e.low, edges_.size()};
    edges_.push_back(edges[e.edge]);
  }
  for (std::size_t p = 0; p < ends.size(); ++p) exits_[next[ends[p].low]++] = {ends[p].high, p};
}

std::optional<std::size_t> NavigationGraph::node_of(ViewId view) const {
  const auto found = std::ranges::lower_bound(views_, view);
  if (found == views_.end() || *found != view) return std::nullopt;
  return static_cast<std::size_t>(found - views_.begin());
}

std::optional<Pose2> NavigationGraph::motion_from(std::size_t node, std::size_t edge) const {
  const NavigationGraph::Edge& p = edges_.at(edge);
  if (!p.a_from_b || views_.at(node) == p.a) return p.a_from_b;
  return inverse(*p.a_from_b);
}

std::vector<std::size_t> nodes_around(const NavigationGraph& graph,
                                      std::span<const std::size_t> from, int links) {
  std::set<std::size_t> found(from.begin(), from.end());
  std::vector<std::size_t> front(found.begin(), found.end());
  for (int i = 0; i < links && !front.empty(); ++i) {
    std::vector<std::size_t> next;
    for (const std::size_t node : front) {
      for (const NavigationGraph::Exit& exit : graph.exits(node)) {
        if (found.insert(exit.node).second) next.push_back(exit.node);
      }
    }
    front.swap(next);
  }
  return {found.begin(), found.end()};
}

NavigationGraph graph_from_links(const ViewSource& source, std::span<const Link> links,
                                 Executor& executor) {
  const std::span<const ViewId> views = source.views();
  std::vector<NavigationGraph::Edge> edges = read_edges(source, links, executor);
  std::vector<NavigationGraph::Edge> read = edges;
  fill_missing_lengths(read);
  const NavigationGraph graph({views.begin(), views.end()}, std::move(read));
  for (NavigationGraph::Edge& edge : edges) {
    if (edge.a_from_b && !is_supported(graph, edge)) {
      edge = {edge.a, edge.b, 0.0, std::nullopt};
    }
  }
  fill_missing_lengths(edges);
  return {{views.begin(), views.end()}, std::move(edges)};
}

NavigationGraph graph_from_map(const TopologicalMap& map, double min_weight) {
  validate(map);
  std::vector<ViewId> views;
  for (const TopologicalMap::Node& node : map.nodes) views.push_back(node.view);
  std::vector<NavigationGraph::Edge> edges;
  for (const TopologicalMap::Edge& edge : map.edges) {
    if (edge.weight < min_weight) continue;
    const TopologicalMap::Node& a =
        *std::ranges::lower_bound(map.nodes, edge.a, {}, &TopologicalMap::Node::view);
    const TopologicalMap::Node& b =
        *std::ranges::lower_bound(map.nodes, edge.b, {}, &TopologicalMap::Node::view);
    if (a.component != b.component) continue;
    const Pose2 a_from_b = inverse(a.pose) * b.pose;
    edges.push_back({edge.a, edge.b, get_length(a_from_b), a_from_b});
  }
  fill_missing_lengths(edges);
  return {std::move(views), std::move(edges)};
}

namespace {

// Returns pairs of nodes of one component that are at most `reach` apart and not joined by an edge.
std::vector<EdgeEnds> find_near_pairs(const TopologicalMap& map, double reach) {
  std::set<std::pair<ViewId, ViewId>> known;
  for (const TopologicalMap::Edge& edge : map.edges) known.insert(std::minmax(edge.a, edge.b));
  // Sorts by x, so that nodes too far away in x need not be visited.
  std::vector<std::size_t> order(map.nodes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return map.nodes[i].pose.x_m; });
  std::vector<EdgeEnds> pairs;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const TopologicalMap::Node& node = map.nodes[order[i]];
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      const TopologicalMap::Node& other = map.nodes[order[j]];
      if (other.pose.x_m - node.pose.x_m > reach) break;
      if (other.component != node.component ||
          distance(node.pose.position(), other.pose.position()) > reach ||
          known.contains(std::minmax(node.view, other.view))) {
        continue;
      }
      pairs.push_back({std::min(order[i], order[j]), std::max(order[i], order[j])});
    }
  }
  std::ranges::sort(pairs, {}, [](const EdgeEnds& p) { return std::pair(p.a, p.b); });
  return pairs;
}

}  // namespace

NavigationGraph make_graph_from_map_and_neighbours(const TopologicalMap& map,
                                                   const VisualMemory& memory, Executor& executor,
                                                   double min_weight) {
  const NavigationGraph mapped = graph_from_map(map, min_weight);
  if (mapped.edges().empty()) return mapped;
  std::vector<double> lengths;
  std::vector<double> differences;
  for (const NavigationGraph::Edge& edge : mapped.edges()) {
    lengths.push_back(edge.length);
    differences.push_back(image_difference(homing_view(memory.signature(edge.a)),
                                           homing_view(memory.signature(edge.b))));
  }
  // Limits of a pair: a grid's diagonal is 1.41 spacings; 90 % of the edges have a smaller
  // difference.
  const double reach = 1.5 * upper_median(lengths);
  const double max_difference = quantile(differences, 0.9);
  const std::vector<EdgeEnds> pairs = find_near_pairs(map, reach);
  std::vector<std::optional<NavigationGraph::Edge>> found(pairs.size());
  constexpr std::size_t pairs_per_chunk = 64;
  executor.for_each_chunk(
      pairs.size(), pairs_per_chunk, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t i = begin; i < end; ++i) {
          const TopologicalMap::Node& a = map.nodes[pairs[i].a];
          const TopologicalMap::Node& b = map.nodes[pairs[i].b];
          const HomingView view_a = homing_view(memory.signature(a.view));
          const HomingView view_b = homing_view(memory.signature(b.view));
          if (image_difference(view_a, view_b) > max_difference) continue;
          const Pose2 laid_out = inverse(a.pose) * b.pose;
          const auto reading = read_phases(
              view_a, view_b,
              HeadingWindow{static_cast<float>(laid_out.heading_rad), max_heading_error_rad});
          if (!reading || reading->disagreement_rad > max_disagreement_rad) continue;
          auto motion = to_motion(*reading);
          if (!motion) continue;
          const double length = get_length(laid_out);
          const double read = get_length(*motion);
          if (read > 0.0) scale_displacement(*motion, length / read);
          found[i] = NavigationGraph::Edge{a.view, b.view, length, motion};
        }
      });
  std::vector<NavigationGraph::Edge> edges(mapped.edges().begin(), mapped.edges().end());
  for (const auto& edge : found) {
    if (edge) edges.push_back(*edge);
  }
  fill_missing_lengths(edges);
  return {{mapped.views().begin(), mapped.views().end()}, std::move(edges)};
}

}  // namespace panonav
