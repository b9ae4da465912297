#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/navigation/search_whole_memory.hpp"
#include "panonav/navigation/sub_areas.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/relative_pose/reference_views.hpp"
#include "panonav/signature/compass.hpp"

namespace panonav {

/// What a robot sees, as references are compared with it.
struct SeenView {
  /// Throws ContractError unless `components` is 0 (all) or 3 .. those of the signature.
  SeenView(const FourierSignature& seen, float full_scale, int components = 0);

  PackedSignature packed;  ///< with the memory's full scale
  HomingView view;         ///< the first `components` only
  int components;          ///< that are compared
};

/// The views of one area and those around it, loaded from a source: what a robot needs to have at
/// hand. Of the memory nothing else is held but what was loaded ahead of the area that comes next.
class AreaViews {
 public:
  /// Views up to `links` edges outside an area are loaded with it. The source must outlive
  /// *this.
  AreaViews(const ViewSource& source, int links);

  /// Loads the area, or what of it was not loaded ahead.
  void enter(const NavigationGraph& graph, const SubAreas& areas, std::size_t area);
  /// Loads some views of the area that will be entered next, `max_views` at most, so that no look
  /// has to wait for all of them. Another area than at the last call: what was loaded is dropped.
  void load_ahead(const NavigationGraph& graph, const SubAreas& areas, std::size_t area,
                  int max_views);
  /// Empty before the first `enter`.
  [[nodiscard]] std::optional<std::size_t> area() const noexcept;
  /// Views held, those loaded ahead included.
  [[nodiscard]] std::size_t size() const noexcept { return here_.loaded + ahead_.loaded; }
  /// Whether it belongs to the area that was entered.
  [[nodiscard]] bool holds(ViewId view) const { return part_of(view) != nullptr; }

  /// Throw ContractError on a view that is not loaded.
  /// How far the robot is turned against the view.
  [[nodiscard]] std::optional<CompassReading> turn_against(ViewId view, const SeenView& seen);
  /// All its coefficients, computed when it was loaded; compared with a view of fewer components
  /// only the common ones, `components`, count (0: all). Valid until the next `enter`.
  [[nodiscard]] const HomingView& view(ViewId view, int components = 0);
  /// The least dissimilar of those `nodes` that are loaded; empty when none is. Ties by node.
  [[nodiscard]] std::optional<FoundView> nearest(const NavigationGraph& graph,
                                                 std::span<const std::size_t> nodes,
                                                 const SeenView& seen);
  /// The least dissimilar of all loaded views.
  [[nodiscard]] std::optional<FoundView> nearest(const NavigationGraph& graph,
                                                 const SeenView& seen);

  /// A loaded view, and then the `count` others that are least dissimilar to what is seen.
  [[nodiscard]] std::vector<PackedSignature> with_most_alike(ViewId view, const SeenView& seen,
                                                             int count) const;

  /// Bytes of signatures, and of the index over them, that the comparisons so far have read;
  /// without `with_most_alike`.
  [[nodiscard]] std::uint64_t bytes_read() const noexcept { return bytes_read_; }

 private:
  /// An area as far as it is loaded: the first `loaded` of its views, in parts.
  struct Loading {
    std::optional<std::size_t> area;
    std::vector<ViewId> views;  // ascending
    std::size_t loaded = 0;
    std::vector<VisualMemory> parts;  // ascending, too
    ReferenceViews coefficients;      // of all parts
  };
  void begin(const NavigationGraph& graph, const SubAreas& areas, std::size_t area,
             Loading& loading) const;
  void load(Loading& loading, std::size_t most) const;
  [[nodiscard]] const VisualMemory* part_of(ViewId view) const;

  const ViewSource* source_;
  int links_;
  Loading here_;
  Loading ahead_;
  std::uint64_t bytes_read_ = 0;
};

}  // namespace panonav
