#pragma once

#include <cstddef>
#include <span>

#include "panonav/memory/view_index.hpp"

namespace panonav {

/// Loads the part of a memory that is not held from which its models are learnt: whole areas around
/// sampled views, or neighbours in time of those without a position; at most `max_views`. `views`:
/// all of the memory, ascending; `drawn`: the sampled ones, in the order of sampling.
[[nodiscard]] VisualMemory load_learning_sample(ViewIndex& index, std::span<const ViewId> views,
                                                std::span<const ViewId> drawn,
                                                std::size_t max_views);

}  // namespace panonav
