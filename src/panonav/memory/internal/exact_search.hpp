#pragma once

#include <functional>
#include <span>
#include <vector>

#include "panonav/kernels/distance.hpp"
#include "panonav/memory/internal/sketch_index.hpp"
#include "panonav/memory/internal/view_store.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// The views and the index of the memory that is searched.
struct SearchedViews {
  SignatureShape shape;
  const ViewStore& store;
  const SketchIndex& index;
  std::span<const ViewId> views;         ///< ascending
  std::span<const ViewStore::Row> rows;  ///< of `views`
  std::span<const ViewId> view_of_row;   ///< by row; undefined for rows without a view
};

/// Implements VisualMemory::search; docs/search.md explains why it is exact. `instructions` affects
/// only the speed.
[[nodiscard]] SearchResult exact_search(const SearchedViews& searched, const PackedSignature& query,
                                        const SearchOptions& options, const SearchMask& mask,
                                        kernels::Instructions instructions);

/// Implements VisualMemory::hierarchy.
[[nodiscard]] std::vector<VisualMemory::HierarchyLevel> hierarchical_search(
    const SearchedViews& searched, const PackedSignature& query, double tolerance, int components,
    const std::function<bool(const VisualMemory::HierarchyLevel&)>& stop, const SearchMask& mask,
    kernels::Instructions instructions);

}  // namespace panonav
