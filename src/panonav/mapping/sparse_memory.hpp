#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Which references a memory can do without.
struct SparseMemoryOptions {
  /// A view is redundant when one that is kept differs from it by no more (`image_difference`,
  /// 0 .. 1).
  double max_difference = 0.1;
  /// Only a view so near stands for another, where positions are known: far places may look alike.
  double reach_m = 1.0;
  /// Where they are not known: only a view so many links away.
  int reach_links = 10;
  /// A view is outdated when a newer one was taken within this distance, however it looks: what
  /// changed is replaced by what is there now. 0: no view is.
  double outdated_within_m = 0.0;
};
void visit_options(SparseMemoryOptions& options, OptionVisitor& visitor);

/// What a memory keeps and what it drops.
struct SparseSelection {
  /// A view that is dropped, and the one that stands for it.
  struct Redundant {
    ViewId view;              ///< that the selection drops
    ViewId kept;              ///< that stays in the memory
    double difference = 0.0;  ///< of the two views
    bool outdated = false;    ///< dropped because of a newer view at its place
    friend bool operator==(const Redundant&, const Redundant&) = default;
  };

  std::vector<ViewId> kept;          ///< ascending
  std::vector<Redundant> redundant;  ///< ascending by view
  friend bool operator==(const SparseSelection&, const SparseSelection&) = default;
};

/// Places where views hardly change keep one reference. Views are looked at from the newest to the
/// oldest; each is kept unless a view kept before stands for it. So every dropped view is within
/// `max_difference` of one that is kept, or outdated. Throws OptionError. Cost: one comparison,
/// about 5 microseconds, for each pair of a view and a kept one in reach.
[[nodiscard]] SparseSelection select_references(const VisualMemory& memory,
                                                const SparseMemoryOptions& options = {});

/// The links of the memory that are left: those of a dropped view go to the one that stands for it,
/// so that what was connected stays connected.
[[nodiscard]] std::vector<Link> contract_links(std::span<const Link> links,
                                               const SparseSelection& selection);
/// The same of a map; the motion of an edge that moved is that between the poses of its nodes.
[[nodiscard]] TopologicalMap contract_map(const TopologicalMap& map,
                                          const SparseSelection& selection);

/// What dropping views costs: each dropped view is asked for among the kept ones, and among all
/// others as before.
struct SparseLoss {
  std::size_t asked = 0;           ///< dropped views that were searched
  double median_difference = 0.0;  ///< to the view that stands for it; 0 when nothing is dropped
  /// Distance to the reference found first; empty where fewer than two dropped views have a
  /// position.
  struct Positions {
    double median_before_m = 0.0;  ///< where all other views are searched
    double p95_before_m = 0.0;     ///< the same; 95 % are at most this
    double median_after_m = 0.0;   ///< where the kept views are searched
    double p95_after_m = 0.0;      ///< the same; 95 % are at most this
  };
  std::optional<Positions> positions;  ///< where positions are known
};

/// Asks for at most `max_asked` dropped views, evenly spread. Throws ContractError unless
/// max_asked >= 1.
[[nodiscard]] SparseLoss measure_loss(const VisualMemory& memory, const SparseSelection& selection,
                                      std::size_t max_asked = 1000);

}  // namespace panonav
