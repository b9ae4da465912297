#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/neighbour_support.hpp"
#include "panonav/signature/local_features.hpp"

namespace panonav {

/// Returns the local features of a view of the memory; nullopt where it has none.
using FeatureSource = std::function<std::optional<LocalFeatures>(ViewId)>;

/// Which image of a query local features are made of.
enum class Handedness {
  as_seen,  ///< the view as it was taken
  mirrored  ///< its mirror image, which shows a place that does not exist
};
/// Makes the local features of a query where they are needed; nullopt where elevations are unknown.
using QueryFeatures = std::function<std::optional<LocalFeatures>(Handedness)>;

/// Matches that are compared by local features: enough that the right one is among them in a memory
/// with references 2 m apart, few enough that a query stays below 5 ms.
inline constexpr int verified_candidates = 24;

/// The last stage of re-ranking: orders the first `verified_candidates` by the features that they
/// share with the query (`match_features`), most first; equal ones keep their order. Sets the
/// number of verified features of each, and the rotation where there are any. Cost: 0.1 ms a match.
void rank_by_verified_features(const LocalFeatures& query, const FeatureSource& features,
                               std::vector<RankedMatch>& ranked);

/// Statistics of how well local features find the places of a memory, by views left out in turn.
struct FeatureTrial {
  int sampled_views = 0;   ///< left out in turn, at most 100
  int columns_right = 0;   ///< best match within 1.5 times the distance of the nearest view
  int features_right = 0;  ///< the same with features put first
  int gained = 0;          ///< right by features and not by columns
  int lost = 0;            ///< right by columns and not by features
  /// The sign test: if features were no better, as many gains among the changes would occur in at
  /// most one of 20 cases [McNemar 1947].
  [[nodiscard]] bool is_significantly_better() const;
};

/// Tries whether local features find the places of this memory better than columns do: between
/// views that are far apart they do, between neighbours 0.3 m apart columns are right already.
/// Leaves out at most 100 views; the nearest view is the one at the smallest distance, or the next
/// in the order of appending where views have no positions. Cost: 3 ms for each view left out.
[[nodiscard]] FeatureTrial evaluate_features(const ColumnRanking& ranking,
                                             const NeighbourSupport& support,
                                             const FeatureSource& features);

}  // namespace panonav
