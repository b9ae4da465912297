#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/homing/homing_view.hpp"
#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/navigation/sub_areas.hpp"

namespace panonav {

/// A reference that looks like the robot's view.
struct FoundView {
  std::size_t node = 0;
  std::uint32_t dissimilarity = 0;  ///< as the memory has it
  double difference = 0.0;          ///< by `image_difference`: magnitudes and phases
};

/// The views of one area and those around it, loaded from a source: what a robot needs to have at
/// hand. Nothing else of the memory is held.
class AreaViews {
 public:
  /// Views up to `links` passages outside an area are loaded with it. The source must outlive
  /// *this.
  AreaViews(const ViewSource& source, int links);

  /// Loads the area, unless it is loaded.
  void enter(const NavigationGraph& graph, const SubAreas& areas, std::size_t area);
  /// Empty before the first `enter`.
  [[nodiscard]] std::optional<std::size_t> area() const noexcept { return area_; }
  [[nodiscard]] std::size_t size() const noexcept { return memory_ ? memory_->size() : 0; }
  [[nodiscard]] bool holds(ViewId view) const { return memory_ && memory_->contains(view); }

  /// These need a loaded area; they throw ContractError otherwise, and on a view that is not
  /// loaded.
  [[nodiscard]] const VisualMemory& memory() const;
  [[nodiscard]] HomingView view(ViewId view) const;
  /// The least dissimilar of those `nodes` that are loaded; empty when none is. Ties by node.
  [[nodiscard]] std::optional<FoundView> nearest(const NavigationGraph& graph,
                                                 std::span<const std::size_t> nodes,
                                                 const PackedSignature& packed,
                                                 const HomingView& view) const;
  /// The least dissimilar of all loaded views.
  [[nodiscard]] std::optional<FoundView> nearest(const NavigationGraph& graph,
                                                 const PackedSignature& packed,
                                                 const HomingView& view) const;

 private:
  const ViewSource* source_;
  int links_;
  std::optional<std::size_t> area_;
  std::optional<VisualMemory> memory_;
};

/// Relocalisation over the whole memory, one area after the other, so that no more than one is
/// held: of the least dissimilar views of each area the one whose difference is least. Empty when
/// there is no view. Cost: loads all.
[[nodiscard]] std::optional<FoundView> search_everywhere(const ViewSource& source,
                                                         const NavigationGraph& graph,
                                                         const SubAreas& areas,
                                                         const FourierSignature& view);

}  // namespace panonav
