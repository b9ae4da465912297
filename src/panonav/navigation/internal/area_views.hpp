#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/navigation/search_whole_memory.hpp"
#include "panonav/navigation/sub_areas.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/signature/compass.hpp"

namespace panonav {

/// The view of a robot in the forms in which references are compared with it.
struct QueryView {
  /// Throws ContractError unless `components` is 0 (all) or 3 .. those of the signature.
  QueryView(const FourierSignature& signature, float full_scale, int components = 0);

  PackedSignature packed;  ///< with the memory's full scale
  HomingView view;         ///< the first `components` only
  int components;          ///< that are compared
};

/// The views of one area and those around it, loaded from a source. Nothing else of the memory is
/// held but what was prefetched of the next area.
class AreaViews {
 public:
  /// Views up to `links` edges outside of an area are loaded with it. The source must outlive
  /// *this.
  AreaViews(const ViewSource& source, int links) : source_(&source), links_(links) {}

  /// Loads the part of the area that was not prefetched.
  void enter(const NavigationGraph& graph, const SubAreas& areas, std::size_t area);
  /// Loads at most `max_views` further views of the area that will be entered next. Drops what was
  /// prefetched of another area.
  void prefetch(const NavigationGraph& graph, const SubAreas& areas, std::size_t area,
                int max_views);
  /// nullopt before the first `enter`.
  [[nodiscard]] std::optional<std::size_t> area() const noexcept { return here_.area; }
  /// Number of views held, prefetched ones included.
  [[nodiscard]] std::size_t size() const noexcept { return here_.loaded + ahead_.loaded; }
  /// True if the view was loaded with the area that was entered.
  [[nodiscard]] bool holds(ViewId view) const { return find_part(view) != nullptr; }

  // These throw ContractError on a view that is not loaded.
  /// Returns the heading of the robot relative to the view; nullopt where the compass tells none.
  [[nodiscard]] std::optional<CompassReading> read_compass(ViewId view, const QueryView& query);
  /// Returns all coefficients of the view, computed when it was loaded. Counts the bytes of
  /// `components` of them as read (0: all). Valid until the next `enter`.
  [[nodiscard]] const HomingView& read_coefficients(ViewId view, int components = 0);
  /// Returns the view of least dissimilarity among those of `nodes` that are loaded; the lower node
  /// of equal ones.
  [[nodiscard]] std::optional<FoundView> find_nearest(const NavigationGraph& graph,
                                                      std::span<const std::size_t> nodes,
                                                      const QueryView& query);
  /// Finds the nearest view among all loaded ones.
  [[nodiscard]] std::optional<FoundView> find_nearest(const NavigationGraph& graph,
                                                      const QueryView& query);
  /// Returns the view, then the `count` others of least dissimilarity to the query.
  [[nodiscard]] std::vector<PackedSignature> most_similar_signatures(ViewId view,
                                                                     const QueryView& query,
                                                                     int count) const;

  /// Bytes of signatures and of their index that the comparisons so far have read, without
  /// `most_similar_signatures`.
  [[nodiscard]] std::uint64_t bytes_read() const noexcept { return bytes_read_; }

 private:
  /// An area of which the first `loaded` views are loaded, in parts.
  struct LoadedArea {
    std::optional<std::size_t> area;
    std::vector<ViewId> views;  // ascending
    std::size_t loaded = 0;
    std::vector<VisualMemory> parts;            // ascending
    std::map<ViewId, HomingView> coefficients;  // of all parts
  };
  [[nodiscard]] LoadedArea list_area(const NavigationGraph& graph, const SubAreas& areas,
                                     std::size_t area) const;
  void load(LoadedArea& area, std::size_t max_views) const;
  [[nodiscard]] const VisualMemory* find_part(ViewId view) const;
  [[nodiscard]] const VisualMemory& part_of(ViewId view) const;

  const ViewSource* source_;
  int links_;
  LoadedArea here_;
  LoadedArea ahead_;
  std::uint64_t bytes_read_ = 0;
};

}  // namespace panonav
