#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Number of views that a model is learnt from.
struct LearningOptions {
  int sampled_views = 100;    ///< left out in turn; all of smaller memories
  int compared_views = 1000;  ///< with which each is compared; all of smaller memories
  int seed = 1;               ///< of the draws
};
void visit_options(LearningOptions& options, OptionVisitor& visitor);

/// Returns all of `views` if there are at most `count`, else `count` of them sampled without
/// repetition; in ascending order.
[[nodiscard]] std::vector<ViewId> sample_views(std::span<const ViewId> views, int count,
                                               std::uint64_t seed);

}  // namespace panonav
