#include "panonav/navigation/internal/place_scale.hpp"

#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/view_pair.hpp"

namespace panonav {

namespace {

using ViewPair = std::pair<ViewId, ViewId>;

VisualMemory load_views_of_pairs(const ViewSource& source, const std::vector<ViewPair>& pairs) {
  std::set<ViewId> ids;
  for (const auto& [a, b] : pairs) ids.insert({a, b});
  return source.load(std::vector<ViewId>(ids.begin(), ids.end()));
}

double median_difference(const ViewSource& source, const std::vector<ViewPair>& pairs,
                         int components) {
  const VisualMemory memory = load_views_of_pairs(source, pairs);
  const auto view = [&](ViewId id) {
    const HomingView whole = homing_view(memory.signature(id));
    return components == 0 ? whole : first_components(whole, components);
  };
  std::vector<double> differences;
  for (const auto& [a, b] : pairs) differences.push_back(image_difference(view(a), view(b)));
  return upper_median(std::move(differences));
}

}  // namespace

PlaceScale learn_place_scale(const ViewSource& source, const NavigationGraph& graph, int components,
                             int samples) {
  require(samples >= 1, "samples", samples, ">= 1");
  const auto max_pairs = static_cast<std::size_t>(samples);
  PlaceScale scale;
  std::vector<ViewPair> linked;
  const std::size_t edges = graph.edges().size();
  for (std::size_t i = 0; i < std::min(max_pairs, edges); ++i) {
    const NavigationGraph::Edge& edge = graph.edges()[i * edges / std::min(max_pairs, edges)];
    linked.emplace_back(edge.a, edge.b);
  }
  if (!linked.empty()) scale.neighbour_difference = median_difference(source, linked, components);
  // Pairs each view with the one half of all views later, since nearly all of these pairs are far
  // from each other.
  std::vector<ViewPair> distant_pairs;
  const std::size_t half = graph.size() / 2;
  for (std::size_t i = 0; i < std::min(max_pairs, half); ++i) {
    const std::size_t first = i * half / std::min(max_pairs, half);
    distant_pairs.emplace_back(graph.view(first), graph.view(first + half));
  }
  if (!distant_pairs.empty())
    scale.distant_pair_difference = median_difference(source, distant_pairs, components);
  return scale;
}

ArrivalScale learn_arrival_scale(const ViewSource& source, const NavigationGraph& graph,
                                 ViewId goal) {
  const auto node = graph.node_of(goal);
  require(node.has_value(), "goal", static_cast<double>(goal.value), "a view of the graph");
  std::vector<ViewPair> pairs;
  ArrivalScale scale;
  if (graph.exits(*node).empty()) return scale;
  std::vector<double> lengths;
  for (const NavigationGraph::Edge& edge : graph.edges()) lengths.push_back(edge.length);
  const double typical = upper_median(std::move(lengths));
  // Views of the goal from another drive are too near to measure the spacing, so they are used only
  // if there are no others.
  for (const double min_length : {0.5 * typical, 0.0}) {
    for (const auto& exit : graph.exits(*node)) {
      if (graph.edges()[exit.edge].length < min_length) continue;
      pairs.emplace_back(goal, graph.view(exit.node));
    }
    if (!pairs.empty()) break;
  }
  const VisualMemory memory = load_views_of_pairs(source, pairs);
  const HomingView home = homing_view(memory.signature(goal));
  std::vector<std::pair<double, double>> nearest;  // length, difference
  for (const auto& [unused, neighbour] : pairs) {
    const HomingView view = homing_view(memory.signature(neighbour));
    const auto reading = read_phases(home, view);
    if (reading && reading->has_direction) {
      nearest.emplace_back(reading->length, image_difference(home, view));
    }
  }
  if (nearest.empty()) return scale;
  std::ranges::sort(nearest);
  nearest.resize(std::min<std::size_t>(nearest.size(), 3));
  const auto [length, difference] = nearest[nearest.size() / 2];
  return {0.5 * difference, 0.5 * length, true};
}

}  // namespace panonav
