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

/// Searches the whole memory for a view, area by area, so that only one area is held at a time. Of
/// the three views of smallest dissimilarity of each area, returns the one with the smallest
/// difference; nullopt if there are no views. `filter` selects the nodes to search (empty: all).
/// Cost: loads all views searched.
[[nodiscard]] std::optional<FoundView> search_whole_memory(
    const ViewSource& source, const NavigationGraph& graph, const SubAreas& areas,
    const FourierSignature& view, const std::function<bool(std::size_t node)>& filter = {});

}  // namespace panonav
