#pragma once

#include <span>
#include <vector>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/memory/view_index.hpp"
#include "panonav/memory/visual_memory.hpp"

/// The views that a query needs from a memory that is not held.
namespace panonav {

/// Returns rectangles around the references that may support one of the matches
/// (`NeighbourSupport`) or belong to its layout. `spacing_m`: of the references with headings;
/// `position_spacing_m`: of all with positions.
[[nodiscard]] std::vector<PositionBounds> bound_neighbours(const VisualMemory& memory,
                                                           std::span<const RankedMatch> ranked,
                                                           double spacing_m,
                                                           double position_spacing_m);

/// Returns the views of both memories. Of a view that both have, that of `part`.
[[nodiscard]] VisualMemory join_memories(const VisualMemory& part, const VisualMemory& sampled);

}  // namespace panonav
