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

/// A robot's view in the two forms used for comparing it with references.
struct QueryView {
  /// Throws ContractError unless `components` is 0 (all), or from 3 to the number of the signature.
  QueryView(const FourierSignature& signature, float full_scale, int components = 0);

  PackedSignature packed;  ///< packed with the memory's full scale
  HomingView view;         ///< only its first `components`
  int components;          ///< number of components compared
};

/// Holds the views in and around one area, loaded from a source, and prefetched views of the next
/// area, but nothing else of the memory.
class AreaViews {
 public:
  /// `links`: views up to this number of edges outside of an area are loaded with it. The source
  /// must outlive *this.
  AreaViews(const ViewSource& source, int links) : source_(&source), links_(links) {}

  /// Makes this the current area and loads its views that were not prefetched.
  void enter(const NavigationGraph& graph, const SubAreas& areas, std::size_t area);
  /// Loads at most `max_views` further views of the area that will be entered next. Drops views
  /// prefetched for another area.
  void prefetch(const NavigationGraph& graph, const SubAreas& areas, std::size_t area,
                int max_views);
  /// Current area; nullopt before the first `enter`.
  [[nodiscard]] std::optional<std::size_t> area() const noexcept { return current_.area; }
  /// Number of views held, prefetched ones included.
  [[nodiscard]] std::size_t size() const noexcept { return current_.loaded + prefetched_.loaded; }
  /// True if the view was loaded with the current area.
  [[nodiscard]] bool holds(ViewId view) const { return find_part(view) != nullptr; }

  // These throw ContractError on a view that is not loaded.
  /// Returns the robot's heading relative to the view; nullopt if the compass finds none.
  [[nodiscard]] std::optional<CompassReading> read_compass(ViewId view, const QueryView& query);
  /// Returns all Fourier coefficients of the view, computed when it was loaded. Adds the bytes of
  /// the first `components` (0: all) to `bytes_read`. Valid until the next `enter`.
  [[nodiscard]] const HomingView& read_coefficients(ViewId view, int components = 0);
  /// Returns the view of smallest dissimilarity among the loaded views of `nodes`; of ties the
  /// lowest node.
  [[nodiscard]] std::optional<FoundView> find_nearest(const NavigationGraph& graph,
                                                      std::span<const std::size_t> nodes,
                                                      const QueryView& query);
  /// Returns the view of smallest dissimilarity among all loaded ones.
  [[nodiscard]] std::optional<FoundView> find_nearest(const NavigationGraph& graph,
                                                      const QueryView& query);
  /// Returns the signature of `view`, then those of the `count` other views of smallest
  /// dissimilarity to the query.
  [[nodiscard]] std::vector<PackedSignature> most_similar_signatures(ViewId view,
                                                                     const QueryView& query,
                                                                     int count) const;

  /// Bytes of signatures and index read by all comparisons so far, except
  /// `most_similar_signatures`.
  [[nodiscard]] std::uint64_t bytes_read() const noexcept { return bytes_read_; }

 private:
  /// An area whose first `loaded` views are loaded, in several parts.
  struct AreaCache {
    std::optional<std::size_t> area;
    std::vector<ViewId> views;  // ascending
    std::size_t loaded = 0;
    std::vector<VisualMemory> parts;            // ascending
    std::map<ViewId, HomingView> coefficients;  // of all parts
  };
  [[nodiscard]] AreaCache make_area_cache(const NavigationGraph& graph, const SubAreas& areas,
                                          std::size_t area) const;
  void load(AreaCache& area, std::size_t max_views) const;
  [[nodiscard]] const VisualMemory* find_part(ViewId view) const;
  [[nodiscard]] const VisualMemory& part_of(ViewId view) const;

  const ViewSource* source_;
  int links_;
  AreaCache current_;
  AreaCache prefetched_;
  std::uint64_t bytes_read_ = 0;
};

}  // namespace panonav
