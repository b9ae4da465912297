#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/navigation/sub_areas.hpp"

namespace panonav {

/// A reference that resembles the robot's view.
struct FoundView {
  std::size_t node = 0;             ///< of the navigation graph
  std::uint32_t dissimilarity = 0;  ///< as the memory defines it, over the components compared
  double difference = 0.0;          ///< `image_difference`, of magnitudes and phases
};

/// Relocalises in the whole memory, one area after the other, so that only one is held: of the
/// least dissimilar views of each area the one of least difference. Only nodes that `filter`
/// accepts count (empty: all). nullopt when there is none. Cost: loads all that count.
[[nodiscard]] std::optional<FoundView> search_whole_memory(
    const ViewSource& source, const NavigationGraph& graph, const SubAreas& areas,
    const FourierSignature& view, const std::function<bool(std::size_t node)>& filter = {});

}  // namespace panonav
