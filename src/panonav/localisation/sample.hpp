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

}  // namespace panonav
