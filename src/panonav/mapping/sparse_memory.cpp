#include "panonav/mapping/sparse_memory.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/point_grid.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

namespace {

// Returns the views at most `links` links away, without the view itself.
std::vector<ViewId> find_views_within_links(const VisualMemory& memory, ViewId view, int links) {
  std::unordered_set<ViewId> visited{view};
  std::vector<ViewId> found;
  std::vector<ViewId> front{view};
  for (int i = 0; i < links && !front.empty(); ++i) {
    std::vector<ViewId> next;
    for (const ViewId at : front) {
      for (const ViewId neighbour : memory.neighbours(at)) {
        if (visited.insert(neighbour).second) next.push_back(neighbour);
      }
    }
    found.insert(found.end(), next.begin(), next.end());
    front = std::move(next);
  }
  return found;
}

/// The kept view that represents each dropped one.
using Representatives = std::unordered_map<ViewId, ViewId>;

Representatives make_representatives(const SparseSelection& selection) {
  Representatives kept;
  for (const auto& redundant : selection.redundant) kept.emplace(redundant.view, redundant.kept);
  return kept;
}

/// Returns the view that represents `view`; a kept view represents itself.
ViewId find_representative(const Representatives& kept, ViewId view) {
  const auto found = kept.find(view);
  return found == kept.end() ? view : found->second;
}

}  // namespace

void visit_options(SparseMemoryOptions& options, OptionVisitor& visitor) {
  using T = SparseMemoryOptions;
  constexpr OptionTable table{
      option<&T::max_difference>(
          "A view is redundant if its difference from a kept view is at most this", 0, 1),
      option<&T::reach_m>("A view is redundant only if that kept view is within this distance; "
                          "used if positions are known",
                          above(0), 1e6),
      option<&T::reach_links>(
          "A view is redundant only if that kept view is within this number of links; "
          "used if positions are unknown",
          0, 1000),
      option<&T::outdated_within_m>(
          "Also delete a view as outdated if a newer view is within this distance; 0: never", 0,
          1e6),
  };
  table.visit(options, visitor);
}

SparseSelection select_references(const VisualMemory& memory, const SparseMemoryOptions& options) {
  validate(options);
  SparseSelection selection;
  const double reach_m = std::max(options.reach_m, options.outdated_within_m);
  PointGrid by_position(reach_m);
  std::unordered_map<ViewId, HomingView> kept;
  const auto views = memory.views();
  for (auto at = views.rbegin(); at != views.rend(); ++at) {
    const ViewId view = *at;
    HomingView coefficients = homing_view(memory, view);
    const auto& pose = memory.info(view).pose;
    const std::string_view floor = floor_of(memory.info(view).name);
    std::optional<SparseSelection::Redundant> best;
    const auto consider = [&](ViewId other, std::optional<double> distance_m) {
      const auto found = kept.find(other);
      if (found == kept.end() || floor_of(memory.info(other).name) != floor) return;
      const double difference = image_difference(found->second, coefficients);
      const bool outdated = distance_m && *distance_m < options.outdated_within_m;
      const bool is_similar =
          difference <= options.max_difference && (!distance_m || *distance_m <= options.reach_m);
      if (!outdated && !is_similar) return;
      if (best && best->difference <= difference) return;
      best = SparseSelection::Redundant{view, other, difference, !is_similar};
    };
    if (pose) {
      by_position.visit_near(pose->position(), [&](std::uint32_t other, Point2 position) {
        const double distance_m = distance(position, pose->position());
        if (distance_m <= reach_m) consider(ViewId{other}, distance_m);
      });
    } else {
      for (const ViewId other : find_views_within_links(memory, view, options.reach_links)) {
        consider(other, std::nullopt);
      }
    }
    if (best) {
      selection.redundant.push_back(*best);
      continue;
    }
    selection.kept.push_back(view);
    kept.emplace(view, std::move(coefficients));
    if (pose) by_position.add(view.value, pose->position());
  }
  std::ranges::reverse(selection.kept);
  std::ranges::reverse(selection.redundant);
  return selection;
}

std::vector<Link> contract_links(std::span<const Link> links, const SparseSelection& selection) {
  const Representatives kept = make_representatives(selection);
  std::set<std::pair<ViewId, ViewId>> pairs;
  std::vector<Link> left;
  for (const Link& link : links) {
    const Link moved{find_representative(kept, link.a), find_representative(kept, link.b),
                     link.kind};
    if (moved.a != moved.b && pairs.insert(std::minmax(moved.a, moved.b)).second)
      left.push_back(moved);
  }
  return left;
}

TopologicalMap contract_map(const TopologicalMap& map, const SparseSelection& selection) {
  validate(map);
  const Representatives kept = make_representatives(selection);
  TopologicalMap left;
  for (const TopologicalMap::Node& node : map.nodes) {
    if (find_representative(kept, node.view) == node.view) left.nodes.push_back(node);
  }
  const auto node_of = [&](ViewId view) -> const TopologicalMap::Node* {
    const auto found = std::ranges::lower_bound(left.nodes, view, {}, &TopologicalMap::Node::view);
    return found != left.nodes.end() && found->view == view ? &*found : nullptr;
  };
  std::set<std::pair<ViewId, ViewId>> pairs;
  for (const TopologicalMap::Edge& edge : map.edges) {
    TopologicalMap::Edge moved = edge;
    moved.a = find_representative(kept, edge.a);
    moved.b = find_representative(kept, edge.b);
    const TopologicalMap::Node* const a = node_of(moved.a);
    const TopologicalMap::Node* const b = node_of(moved.b);
    // The representing view may be outside of the map or in another component; the edge is then
    // dropped.
    if (moved.a == moved.b || a == nullptr || b == nullptr || a->component != b->component)
      continue;
    if (!pairs.insert(std::minmax(moved.a, moved.b)).second) continue;
    if (moved.a != edge.a || moved.b != edge.b) moved.a_from_b = inverse(a->pose) * b->pose;
    left.edges.push_back(moved);
  }
  renumber_components(left);
  return left;
}

SparseSelection::Loss measure_loss(const VisualMemory& memory, const SparseSelection& selection,
                                   std::size_t max_queries) {
  require(max_queries >= 1, "max_queries", static_cast<double>(max_queries), ">= 1");
  SparseSelection::Loss loss;
  const std::size_t count = selection.redundant.size();
  if (count == 0) return loss;
  std::vector<ViewId> dropped;
  for (const SparseSelection::Redundant& redundant : selection.redundant)
    dropped.push_back(redundant.view);
  const std::size_t queries = std::min(count, max_queries);
  std::vector<double> differences;
  std::vector<double> before_m;
  std::vector<double> after_m;
  for (std::size_t i = 0; i < queries; ++i) {
    const SparseSelection::Redundant& redundant = selection.redundant[i * count / queries];
    differences.push_back(redundant.difference);
    const auto& pose = memory.info(redundant.view).pose;
    if (!pose) continue;
    const PackedSignature query = memory.packed(redundant.view);
    const std::vector<ViewId> itself{redundant.view};
    const auto error_m = [&](std::span<const ViewId> excluded) -> std::optional<double> {
      const auto found = memory.search(query, {.top = 1}, {.excluded_views = excluded});
      if (found.matches.empty()) return std::nullopt;
      const auto other = find_position(memory.info(found.matches.front().view));
      if (!other || other->floor != floor_of(memory.info(redundant.view).name)) return std::nullopt;
      return distance(other->point, pose->position());
    };
    const auto before = error_m(itself);
    const auto after = error_m(dropped);
    if (!before || !after) continue;
    before_m.push_back(*before);
    after_m.push_back(*after);
  }
  loss.queries = queries;
  loss.median_difference = order_statistic(differences, 0.5);
  if (before_m.size() >= 2) {
    loss.positions = SparseSelection::Loss::Positions{
        order_statistic(before_m, 0.5), order_statistic(before_m, 0.95),
        order_statistic(after_m, 0.5), order_statistic(after_m, 0.95)};
  }
  return loss;
}

}  // namespace panonav
