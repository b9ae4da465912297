#pragma once

#include <functional>
#include <span>
#include <vector>

#include "panonav/kernels/distance.hpp"
#include "panonav/memory/internal/sketch_index.hpp"
#include "panonav/memory/internal/view_store.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// The views and index of one memory that a search runs over.
struct SearchedViews {
  SignatureShape shape;
  const ViewStore& store;
  const SketchIndex& index;
  std::span<const ViewId> views;         ///< ascending
  std::span<const ViewStore::Row> rows;  ///< of `views`
  std::span<const ViewId> view_of_row;   ///< by row; rows without a view hold anything
};

/// The body of VisualMemory::search. docs/search.md says why it is exact. `instructions` decides
/// the speed alone.
[[nodiscard]] SearchResult exact_search(const SearchedViews& searched, const PackedSignature& query,
                                        const SearchOptions& options, const SearchMask& mask,
                                        kernels::Instructions instructions);

/// The body of VisualMemory::hierarchy.
[[nodiscard]] std::vector<VisualMemory::HierarchyLevel> hierarchical_search(
    const SearchedViews& searched, const PackedSignature& query, double tolerance, int components,
    const std::function<bool(const VisualMemory::HierarchyLevel&)>& stop, const SearchMask& mask,
    kernels::Instructions instructions);

}  // namespace panonav
