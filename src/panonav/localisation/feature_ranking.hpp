#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/neighbour_support.hpp"
#include "panonav/signature/local_features.hpp"

namespace panonav {

/// Returns the local features of a view of the memory; nullopt if it has none.
using FeatureSource = std::function<std::optional<LocalFeatures>(ViewId)>;

/// The image of a query from which local features are extracted.
enum class Handedness {
  original,  ///< the view as it was taken
  mirrored   ///< the mirror image, which shows no existing place
};
/// Extracts the local features of a query on demand; nullopt if elevations are unknown.
using QueryFeatures = std::function<std::optional<LocalFeatures>(Handedness)>;

/// Number of matches compared by local features: enough to include the right one if references are
/// 2 m apart, and few enough that a query takes less than 5 ms.
inline constexpr int verified_candidates = 24;

/// Sorts the first `verified_candidates` matches by the number of features that they share with the
/// query (`match_features`), highest first; ties keep their order. Sets `verified_features` of
/// each, and its heading if it shares any. This is the last stage of re-ranking. Cost: 0.1 ms a
/// match.
void rank_by_verified_features(const LocalFeatures& query, const FeatureSource& features,
                               std::vector<RankedMatch>& ranked);

/// Statistics of place recognition with and without local features, from views left out in turn.
struct FeatureTrial {
  int sampled_views = 0;   ///< number of views left out in turn, at most 100
  int columns_right = 0;   ///< best match was within 1.5 times the distance of the nearest view
  int features_right = 0;  ///< the same after sorting by features
  int gained = 0;          ///< right by features but not by columns
  int lost = 0;            ///< right by columns but not by features
  /// True if features are significantly better at the 5 % level by the sign test [McNemar 1947].
  [[nodiscard]] bool is_significantly_better() const;
};

/// Compares place recognition by local features with that by columns in this memory. Features help
/// if views are far apart; for neighbours 0.3 m apart columns are already right. Leaves out at most
/// 100 views in turn. Without positions of all views, a match is right if its own best match is the
/// view again. Cost: 3 ms for each view left out, 9 ms without positions.
[[nodiscard]] FeatureTrial evaluate_features(const ColumnRanking& ranking,
                                             const NeighbourSupport& support,
                                             const FeatureSource& features);

}  // namespace panonav
