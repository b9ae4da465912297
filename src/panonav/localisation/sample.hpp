#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// All of `views` when there are at most `count`, else `count` of them drawn without repetition; in
/// ascending order.
[[nodiscard]] std::vector<ViewId> sample_views(std::span<const ViewId> views, int count,
                                               std::uint64_t seed);

/// The signature with the magnitudes of the rows that do not count set to 0. Empty `allowed_rows`:
/// unchanged.
[[nodiscard]] PackedSignature with_rows(PackedSignature signature,
                                        std::span<const std::uint8_t> allowed_rows);

}  // namespace panonav
