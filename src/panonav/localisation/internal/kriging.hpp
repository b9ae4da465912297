#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/localisation/column_ranking.hpp"
#include "panonav/memory/floors.hpp"

namespace panonav {

/// Distance in spacings beyond which two places are unrelated: farther than the neighbours on a
/// grid.
inline constexpr double elsewhere_spacings = 3.0;

/// Posed views that resemble a query, the best match first.
struct ResemblingViews {
  std::vector<ViewId> views;
  std::vector<FloorPosition> positions;
  Eigen::VectorXd
      squared_query_differences;  ///< squared column differences between the query and each view
  /// Squared column differences between the views: (i, j) compares view j as query with reference
  /// i. The comparison is not quite symmetric; in this order, a query equal to view j gets the
  /// position of view j.
  Eigen::MatrixXd squared_mutual_differences;
};
/// Compares the first `PositionModel::max_candidates` posed views of the matches with each other.
/// Mutual differences of views farther than `neighbourhood_m` from the best match are not computed
/// and 0.
[[nodiscard]] ResemblingViews compare_with_each_other(
    const ColumnRanking& ranking, std::span<const RankedMatch> matches,
    double neighbourhood_m = std::numeric_limits<double>::infinity());

/// Returns the best match's difference divided by that of the best match elsewhere
/// (`elsewhere_spacings`); 0 if there is no match elsewhere.
[[nodiscard]] double ratio_to_elsewhere(const ResemblingViews& near, double spacing_m);

/// A position by ordinary kriging.
struct KrigedPosition {
  Point2 position;                ///< on the floor of the best match
  std::vector<std::size_t> used;  ///< indices of the interpolated resembling views
  std::vector<double> weights;    ///< of the `used` views; sum to 1
  /// Kriging variance: expected squared error in units of the variogram.
  double variance = 0.0;
};
/// Interpolates over the views within `neighbourhood_m` of the best match, on its floor; the
/// variogram is the squared difference over `unit`, to the power of `exponent`.
[[nodiscard]] KrigedPosition krige(const ResemblingViews& near, double neighbourhood_m,
                                   double exponent, double unit);

}  // namespace panonav
