#include "panonav/localisation/position_model.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/localisation/internal/kriging.hpp"

namespace panonav {

std::optional<PositionEstimate> interpolate_position(const ColumnRanking& ranking,
                                                     const PositionModel& model,
                                                     std::span<const RankedMatch> matches) {
  if (matches.empty()) return std::nullopt;
  const auto& nearest = ranking.memory().info(matches[0].match.view).pose;
  if (!nearest) return std::nullopt;
  PositionEstimate estimate;
  if (!model.learnt) {
    estimate.x_m = nearest->x_m;
    estimate.y_m = nearest->y_m;
    estimate.shares = {{matches[0].match.view, 1.0}};
    return estimate;
  }
  const ResemblingViews near = compare_with_each_other(ranking, matches);
  const KrigedPosition kriged =
      krige(near, model.neighbourhood_m, model.exponent, model.difference_unit);
  estimate.x_m = kriged.position.x_m;
  estimate.y_m = kriged.position.y_m;
  estimate.radius_m = (is_surrounded(near, model.spacing_m) ? model.radius_m_per_deviation
                                                            : model.edge_radius_m_per_deviation) *
                      std::sqrt(kriged.variance + min_variance_share * model.variance_unit);
  if (model.ambiguous_from && ratio_to_elsewhere(near, model.spacing_m) >= *model.ambiguous_from) {
    estimate.radius_m = std::max(*estimate.radius_m, model.ambiguous_radius_m);
  }
  for (std::size_t i = 0; i < kriged.used.size(); ++i) {
    estimate.shares.push_back({near.views[kriged.used[i]], kriged.weights[i]});
  }
  return estimate;
}

}  // namespace panonav
