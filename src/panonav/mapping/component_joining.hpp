#pragma once

#include <cstddef>

#include "panonav/mapping/topological_map.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Joins connected components of at most `max_views` views to others if their views show the
/// relative pose: each of these views is compared with the most similar views of other components
/// on its floor, as for a loop closure (`LoopClosureOptions`). At least
/// `LoopClosureOptions::sequence` closures between two components must agree on one relative pose,
/// and at most half as many on another one. Adds these closures as edges and moves the smaller
/// component. Needs no order of the views. Returns the number of components that were joined to
/// others. `memory` contains the map's views. Throws ContractError on a map that `validate`
/// refuses. Cost: a search and up to 7 ms for each of these views.
std::size_t join_small_components(TopologicalMap& map, const VisualMemory& memory,
                                  std::size_t max_views);

}  // namespace panonav
