#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/neighbour_support.hpp"
#include "panonav/localisation/position_model.hpp"

namespace panonav {

/// A place among the matches of a query, and its share of the probability.
struct PlaceShare {
  std::vector<RankedMatch> matches;  ///< of this place, best first
  double share = 1.0;                ///< > 0; the shares of all places sum to 1
};

/// Exponent of a difference in the share of a place. Of the two sides of a symmetric hall, nine
/// tenths of the ratios are above 0.89; this exponent gives them at least `min_named_share`. A
/// logistic regression in corridors of similar doors gives 30 (docs/decisions.md).
inline constexpr double share_exponent = 25.0;
/// Smallest difference in a ratio; below it rounding dominates.
inline constexpr double min_shared_difference = 1e-3;
/// Smallest share of a place that an answer names, as bounds hold for 95 %.
inline constexpr double min_named_share = 0.05;

/// Groups the first posed matches (`PositionModel::max_candidates`) by place and shares the
/// probability among at most 8 places: first that of the first match, then the most probable ones.
/// A chain of near matches that agree on the robot's heading is one place, because
/// lookalikes may be near to each other, but turned.
///
/// The share falls with the 25th power of the difference between the query and the place's best
/// views with their neighbours (`NeighbourSupport`), which depends less on where views were taken
/// than the difference from one view (docs/decisions.md).
///
/// `query`: over all rows. `matches`: best first. `excluded`: no neighbours. Returns only the first
/// group if the model is not learnt. Cost: 4 joint comparisons for each place, 0.1 ms.
[[nodiscard]] std::vector<PlaceShare> share_probability(const ColumnRanking& ranking,
                                                        const NeighbourSupport& support,
                                                        const PositionModel& model,
                                                        const ColumnProfiles& query,
                                                        std::span<const RankedMatch> matches,
                                                        std::span<const ViewId> excluded = {});

/// Returns the number of local features that the query shares with a match; nullopt if its view has
/// none.
using VerifiedFeatureCounter = std::function<std::optional<int>(const RankedMatch&)>;

/// Shares the probability among the places again, most probable first: each feature that the query
/// shares with one place more than with another raises the odds by the same factor
/// (docs/decisions.md). Counts features at the best four views of each place and sets their
/// `verified_features`. Returns false, without any change of the shares, if a place has no view
/// with features. Cost: that of `count` for each view.
bool share_probability_by_features(std::vector<PlaceShare>& places,
                                   const VerifiedFeatureCounter& count);

/// Another place at which the query may have been taken, as seen from the chosen position.
struct OtherPlace {
  double reach_m = 0.0;  ///< distance to the far side of its own radius
  double share = 0.0;    ///< of the probability
};
/// Returns the radius around the chosen position that contains the true one in 95 % of the cases,
/// whichever place is right. `radius_m`: contains it in 95 % of the cases if the chosen place is
/// right; errors there are taken as a circular normal distribution. `share`: of the chosen place.
[[nodiscard]] double radius_over_places(double radius_m, double share,
                                        std::vector<OtherPlace> others);

}  // namespace panonav
