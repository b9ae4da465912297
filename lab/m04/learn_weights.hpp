#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "panonav/memory/visual_memory.hpp"

namespace panonav::lab {

/// Component weights alpha_k of the dissimilarity [M04 eq. 6], for `dissimilarity_weighted`.
struct ComponentWeights {
  std::vector<double> weights;  ///< one per component, >= 0, mean 1
  /// Reliability with which the weighted dissimilarity ranks a near view before a far one: mean
  /// over standard deviation of the margin between the two, on views not used for learning.
  double margin = 0.0;
  double margin_of_equal_weights = 0.0;  ///< the same with all weights 1; at most `margin`
};

/// Learns the weights from the positions of the views [an open question of M04 section 4].
///
/// For each sampled view, views within 1.25 spacings are near views, and the most similar ones
/// beyond 1.75 spacings are far views. The margin of (view, near, far) is the weighted
/// dissimilarity of far minus that of near, divided by the unweighted dissimilarity of the near
/// views. The weights, at least 0, minimise the mean square of (1 - margin), with a cross-validated
/// penalty towards equal weights.
///
/// Larger memories are represented by `sampled_views`, drawn by `seed`. Returns nullopt if fewer
/// than 16 views have both near and far views. Throws ContractError if `sampled_views`
/// is below 16. Cost: a search and 16 comparisons for each.
[[nodiscard]] std::optional<ComponentWeights> learn_component_weights(const VisualMemory& memory,
                                                                      int sampled_views = 300,
                                                                      std::uint64_t seed = 1);

}  // namespace panonav::lab
