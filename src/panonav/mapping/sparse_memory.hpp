#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Options for the references that are redundant.
struct SparseMemoryOptions {
  /// Largest difference (`image_difference`, 0 .. 1) between a redundant view and the kept view
  /// that represents it.
  double max_difference = 0.1;
  /// Largest distance between a redundant view and its kept view if positions are known, as far
  /// places may look similar.
  double reach_m = 1.0;
  int reach_links = 10;  ///< largest number of links between both if positions are not known
  /// A view is outdated if a newer view was taken within this distance, even if both look
  /// different: the newer one shows what has changed. 0: no view is outdated.
  double outdated_within_m = 0.0;
};
void visit_options(SparseMemoryOptions& options, OptionVisitor& visitor);

/// The views that a memory keeps and drops.
struct SparseSelection {
  /// Localisation error by dropping views: each dropped view is searched among all other views
  /// (before) and among the kept ones (after).
  struct Loss {
    std::size_t queries = 0;         ///< dropped views that were searched
    double median_difference = 0.0;  ///< between dropped views and their kept views
    /// Distance between a dropped view and the first match of its search.
    struct Positions {
      double median_before_m = 0.0;  ///< where all other views are searched
      double p95_before_m = 0.0;     ///< quantile of 95 % of the same
      double median_after_m = 0.0;   ///< where the kept views are searched
      double p95_after_m = 0.0;      ///< quantile of 95 % of the same
    };
    /// nullopt where fewer than two dropped views have a position.
    std::optional<Positions> positions;
  };

  /// A view that is dropped, and the one that represents it.
  struct Redundant {
    ViewId view;              ///< is dropped
    ViewId kept;              ///< stays in the memory
    double difference = 0.0;  ///< of the two views
    bool outdated = false;    ///< dropped because of a newer view at its place
    friend bool operator==(const Redundant&, const Redundant&) = default;
  };

  std::vector<ViewId> kept;          ///< ascending
  std::vector<Redundant> redundant;  ///< ascending by view
  friend bool operator==(const SparseSelection&, const SparseSelection&) = default;
};

/// Selects one reference of each place where views hardly change: from the newest view to the
/// oldest, each view is kept unless an already kept one represents it. So every dropped view is
/// outdated or differs by at most `max_difference` from a kept view. Throws OptionError. Cost: one
/// comparison, about 5 microseconds, for each pair of a view and a kept view in reach.
[[nodiscard]] SparseSelection select_references(const VisualMemory& memory,
                                                const SparseMemoryOptions& options = {});

/// Returns the links that remain: the links of a dropped view are moved to the view that represents
/// it, so that connected views stay connected.
[[nodiscard]] std::vector<Link> contract_links(std::span<const Link> links,
                                               const SparseSelection& selection);
/// Removes the dropped views from a map and moves their edges to the representing views; a moved
/// edge gets the motion between the poses of its new nodes.
[[nodiscard]] TopologicalMap contract_map(const TopologicalMap& map,
                                          const SparseSelection& selection);

/// Measures the loss by searches of at most `max_queries` dropped views, evenly spread. Throws
/// ContractError unless max_queries >= 1.
[[nodiscard]] SparseSelection::Loss measure_loss(const VisualMemory& memory,
                                                 const SparseSelection& selection,
                                                 std::size_t max_queries = 1000);

}  // namespace panonav
