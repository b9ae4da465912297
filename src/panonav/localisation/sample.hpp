#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Options of learning a model from views.
struct LearningOptions {
  int sampled_views = 100;    ///< number of views left out in turn; a smaller memory uses all
  int compared_views = 1000;  ///< largest number of views to which each of them is compared
  int seed = 1;               ///< seed of the sampling
};
void visit_options(LearningOptions& options, OptionVisitor& visitor);

/// Returns all of `views` if there are at most `count`, else `count` of them sampled without
/// repetition; in ascending order.
[[nodiscard]] std::vector<ViewId> sample_views(std::span<const ViewId> views, int count,
                                               std::uint64_t seed);

}  // namespace panonav
