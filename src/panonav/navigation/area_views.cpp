#include "panonav/navigation/area_views.hpp"

#include <algorithm>
#include <tuple>

#include "panonav/core/error.hpp"
#include "panonav/homing/fourier_homing.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav {

namespace {

// Of each area, so many views are compared by their phases, too.
constexpr int compared_per_area = 3;

}  // namespace

AreaViews::AreaViews(const ViewSource& source, int links) : source_(&source), links_(links) {}

void AreaViews::enter(const NavigationGraph& graph, const SubAreas& areas, std::size_t area) {
  if (area_ == area) return;
  const std::vector<std::size_t> nodes = nodes_around(graph, areas.nodes.at(area), links_);
  std::vector<ViewId> views;
  views.reserve(nodes.size());
  for (const std::size_t node : nodes) views.push_back(graph.view(node));
  memory_ = source_->load(views);
  area_ = area;
}

const VisualMemory& AreaViews::memory() const {
  if (!memory_) throw ContractError("area", "none", "one that was entered");
  return *memory_;
}

HomingView AreaViews::view(ViewId view) const {
  return homing_view(memory().signature(view));
}

std::optional<FoundView> AreaViews::nearest(const NavigationGraph& graph,
                                            std::span<const std::size_t> nodes,
                                            const PackedSignature& packed,
                                            const HomingView& seen) const {
  std::optional<FoundView> best;
  for (const std::size_t node : nodes) {
    if (!holds(graph.view(node))) continue;
    const auto dissimilarity = dissimilarity_packed(packed, memory().packed(graph.view(node)));
    const bool nearer =
        !best || std::tuple(dissimilarity, node) < std::tuple(best->dissimilarity, best->node);
    if (nearer) best = {node, dissimilarity, 0.0};
  }
  if (best) best->difference = image_difference(view(graph.view(best->node)), seen);
  return best;
}

std::optional<FoundView> AreaViews::nearest(const NavigationGraph& graph,
                                            const PackedSignature& packed,
                                            const HomingView& seen) const {
  const SearchResult found = memory().search(packed, {.top = 1});
  if (found.matches.empty()) return std::nullopt;
  const Match& match = found.matches.front();
  return FoundView{*graph.node_of(match.view), match.dissimilarity,
                   image_difference(view(match.view), seen)};
}

std::optional<FoundView> search_everywhere(const ViewSource& source, const NavigationGraph& graph,
                                           const SubAreas& areas, const FourierSignature& view) {
  const HomingView seen = homing_view(view);
  std::optional<FoundView> best;
  for (const auto& nodes : areas.nodes) {
    std::vector<ViewId> views;
    for (const std::size_t node : nodes) views.push_back(graph.view(node));
    const VisualMemory memory = source.load(views);
    const SearchResult found =
        memory.search(pack(view, memory.full_scale()), {.top = compared_per_area});
    for (const Match& match : found.matches) {
      const double difference = image_difference(homing_view(memory.signature(match.view)), seen);
      if (!best || difference < best->difference) {
        best = {*graph.node_of(match.view), match.dissimilarity, difference};
      }
    }
  }
  return best;
}

}  // namespace panonav
