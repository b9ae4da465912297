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
/// For each sampled view, views within 1.25 spacings are near and the most similar ones beyond 1.75
/// spacings are far. The margin of (view, near, far) is the difference of their weighted
/// dissimilarities over the unweighted one to the near views. The weights, at least 0, minimise the
/// mean square of (1 - margin), with a cross-validated penalty towards equal weights.
///
/// Larger memories are represented by `sampled_views`, drawn by `seed`. nullopt when fewer than 16
/// views have both near and far views. Throws ContractError on fewer than 16 `sampled_views`.
/// Cost: a search and 16 comparisons for each sampled view.
[[nodiscard]] std::optional<ComponentWeights> learn_component_weights(const VisualMemory& memory,
                                                                      int sampled_views = 300,
                                                                      std::uint64_t seed = 1);

}  // namespace panonav::lab
