#pragma once

#include <cstddef>
#include <span>

#include "panonav/memory/view_index.hpp"

namespace panonav {

/// Loads the views from which the models of a memory that is not held are learnt, at most
/// `max_views`: all views in square areas around the sampled views, or views of neighbouring ids if
/// a sampled view has no position. `views`: all of the memory, ascending; `sampled`: in the
/// order of sampling.
[[nodiscard]] VisualMemory load_learning_sample(ViewIndex& index, std::span<const ViewId> views,
                                                std::span<const ViewId> sampled,
                                                std::size_t max_views);

}  // namespace panonav
