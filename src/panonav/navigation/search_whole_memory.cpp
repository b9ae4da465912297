#include "panonav/navigation/search_whole_memory.hpp"

#include <vector>

#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

namespace {

/// Number of least dissimilar views of each area that are also compared by their phases.
constexpr int compared_views_per_area = 3;

}  // namespace

std::optional<FoundView> search_whole_memory(const ViewSource& source, const NavigationGraph& graph,
                                             const SubAreas& areas, const FourierSignature& view,
                                             const std::function<bool(std::size_t)>& filter) {
  const HomingView query = homing_view(view);
  std::optional<FoundView> best;
  for (const auto& nodes : areas.nodes) {
    std::vector<ViewId> views;
    for (const std::size_t node : nodes) {
      if (!filter || filter(node)) views.push_back(graph.view(node));
    }
    if (views.empty()) continue;
    const VisualMemory memory = source.load(views);
    const SearchResult found =
        memory.search(pack(view, memory.full_scale()), {.top = compared_views_per_area});
    for (const Match& match : found.matches) {
      const double difference = image_difference(homing_view(memory, match.view), query);
      if (!best || difference < best->difference) {
        best = {*graph.node_of(match.view), match.dissimilarity, difference};
      }
    }
  }
  return best;
}

}  // namespace panonav
