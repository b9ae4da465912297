#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/navigation/sub_areas.hpp"

namespace panonav {

/// A reference that looks like the robot's view.
struct FoundView {
  std::size_t node = 0;             ///< of the navigation graph
  std::uint32_t dissimilarity = 0;  ///< as the memory has it, over the components compared
  double difference = 0.0;          ///< by `image_difference`: magnitudes and phases
};

/// Relocalisation over the whole memory, one area after the other, so that no more than one is
/// held: of the least dissimilar views of each area the one whose difference is least. `is_wanted`:
/// asked for each node whether it counts; empty: all do. Empty when there is no view. Cost: loads
/// all that count.
[[nodiscard]] std::optional<FoundView> search_whole_memory(
    const ViewSource& source, const NavigationGraph& graph, const SubAreas& areas,
    const FourierSignature& view, const std::function<bool(std::size_t node)>& is_wanted = {});

}  // namespace panonav
