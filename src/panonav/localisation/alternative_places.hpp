#pragma once

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

/// Groups the first posed matches (`PositionModel::max_candidates`) by place and shares the
/// probability among the places: first that of the first match, then the most probable ones. A
/// chain of near matches is one place. Drops places with a share below 5 %, and all after the
/// fourth.
///
/// The share falls with the 25th power of the difference between the query and the place's best
/// views with their neighbours (`NeighbourSupport`), which depends less on where views were taken
/// than the difference from one view (docs/decisions.md).
///
/// `query`: over all rows. `matches`: best first. `excluded`: views not used as neighbours. Only
/// the first group is returned if the model is not learnt. Cost: 4 joint comparisons for each
/// place, 0.1 ms.
[[nodiscard]] std::vector<PlaceShare> share_probability(const ColumnRanking& ranking,
                                                        const NeighbourSupport& support,
                                                        const PositionModel& model,
                                                        const ColumnProfiles& query,
                                                        std::span<const RankedMatch> matches,
                                                        std::span<const ViewId> excluded = {});

}  // namespace panonav
