#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Which references are redundant.
struct SparseMemoryOptions {
  /// A view is redundant when a kept one differs from it by no more (`image_difference`, 0 .. 1).
  double max_difference = 0.1;
  /// Largest distance of the kept view where positions are known: far places may look similar.
  double reach_m = 1.0;
  int reach_links = 10;  ///< links between them, at most, where positions are not known
  /// A view is outdated if a newer one was taken within this distance, however it looks, as the
  /// newer one shows what has changed. 0: none is.
  double outdated_within_m = 0.0;
};
void visit_options(SparseMemoryOptions& options, OptionVisitor& visitor);

/// The views that a memory keeps and drops.
struct SparseSelection {
  /// The price of dropping views: dropped views are searched among the kept ones, and among all
  /// others as before.
  struct Loss {
    std::size_t queries = 0;         ///< dropped views that were searched
    double median_difference = 0.0;  ///< to the view that represents it; 0 when nothing is dropped
    /// Distance to the reference found first.
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

/// Keeps one reference of each place where views hardly change. Goes from the newest view to the
/// oldest and keeps each unless a view kept before represents it. So every dropped view is within
/// `max_difference` of one that is kept, or outdated. Throws OptionError. Cost: one comparison,
/// about 5 microseconds, for each pair of a view and a kept one in reach.
[[nodiscard]] SparseSelection select_references(const VisualMemory& memory,
                                                const SparseMemoryOptions& options = {});

/// Returns the links of the memory that remain: those of a dropped view lead to the one that
/// represents it, so that what was connected stays connected.
[[nodiscard]] std::vector<Link> contract_links(std::span<const Link> links,
                                               const SparseSelection& selection);
/// Contracts the edges of a map in the same way; the motion of an edge that moved is that between
/// the poses of its nodes.
[[nodiscard]] TopologicalMap contract_map(const TopologicalMap& map,
                                          const SparseSelection& selection);

/// Searches at most `max_queries` dropped views, evenly spread. Throws ContractError unless
/// max_queries >= 1.
[[nodiscard]] SparseSelection::Loss measure_loss(const VisualMemory& memory,
                                                 const SparseSelection& selection,
                                                 std::size_t max_queries = 1000);

}  // namespace panonav
