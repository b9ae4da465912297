#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/memory/view_index.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/signature/local_features.hpp"

/// The rows that a query compares, and the views that it needs from a memory that is not held.
namespace panonav {

/// Returns the signature with the magnitudes of disallowed rows set to 0; unchanged without
/// `allowed_rows`.
[[nodiscard]] PackedSignature mask_rows(PackedSignature signature,
                                        std::span<const std::uint8_t> allowed_rows);
/// Returns the features in allowed rows; all without `allowed_rows`.
[[nodiscard]] std::optional<LocalFeatures> mask_rows(std::optional<LocalFeatures> features,
                                                     std::span<const std::uint8_t> allowed_rows);

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
