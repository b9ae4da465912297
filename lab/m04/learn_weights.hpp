#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "panonav/memory/visual_memory.hpp"

namespace panonav::lab {

/// Weights alpha_k of the dissimilarity [M04 eq. 6], for `dissimilarity_weighted`.
struct ComponentWeights {
  std::vector<double> weights;  ///< one per component, >= 0, mean 1
  /// How reliably the weighted dissimilarity ranks a neighbouring view before a farther one: mean
  /// over standard deviation of the margin between the two, for views left out of the learning.
  double margin = 0.0;
  double margin_of_equal_weights = 0.0;  ///< the same with all weights 1; never above `margin`
};

/// Learns the weights from the positions of the views [M04 section 4 leaves open how].
///
/// For each sampled view, views within 1.25 spacings of it are near and views beyond 1.75 spacings
/// are far; of the far ones, the most similar are used. The margin of (view, near, far) is the
/// weighted dissimilarity to the far one less that to the near one, in units of the unweighted
/// dissimilarity to the near ones.
///
/// The weights minimise the mean square of (1 - margin), not below
/// 0: but for their scale this is the largest mean over standard deviation. They are drawn towards
/// equal weights by a penalty; how strongly is chosen by leaving out a quarter of the views at a
/// time, and equal weights are among the choices.
///
/// Of larger memories only `sampled_views`, drawn by `seed`, are used for learning. Empty when
/// fewer than 16 posed views have both near and far views. Throws ContractError on fewer than 16
/// `sampled_views`. Cost: `sampled_views` searches and 16 comparisons of signatures for each.
[[nodiscard]] std::optional<ComponentWeights> learn_component_weights(const VisualMemory& memory,
                                                                      int sampled_views = 300,
                                                                      std::uint64_t seed = 1);

}  // namespace panonav::lab
