#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/localisation/column_ranking.hpp"

namespace panonav {

/// Share of the typical kriging variance that remains where the query equals a reference: noise of
/// the sensor. Chosen by tests/localisation/position_model_test.cpp, where the radius holds 95 %.
inline constexpr double min_variance_share = 0.1;
/// Spacings of the references beyond which a place is elsewhere: farther than the neighbours of a
/// place on a grid.
inline constexpr double elsewhere_spacings = 3.0;

/// Posed views that resemble a query, the best match first.
struct ResemblingViews {
  std::vector<ViewId> views;
  std::vector<Point2> positions;
  Eigen::VectorXd to_query;  ///< squared differences of columns
  /// Similarities between the views: (i, j) compares query j with reference i. Comparing columns is
  /// not quite symmetric; in this order the answer to view j is view j.
  Eigen::MatrixXd between;
};
/// Compares the first `PositionModel::candidates` posed views of the matches with each other.
[[nodiscard]] ResemblingViews compare_with_each_other(const ColumnRanking& ranking,
                                                      std::span<const RankedMatch> matches);

/// Returns the best match's difference over that of the best match elsewhere; 0 where there is
/// none.
[[nodiscard]] double ratio_to_elsewhere(const ResemblingViews& near, double spacing_m);
/// True if similar references stand all around the nearest one.
[[nodiscard]] bool is_surrounded(const ResemblingViews& near, double spacing_m);

/// A position by ordinary kriging.
struct KrigedPosition {
  Point2 position;
  double variance = 0.0;          ///< in units of the variogram
  std::vector<std::size_t> used;  ///< numbers of the resembling views
  std::vector<double> weights;    ///< of these
};
/// Interpolates over the views within `neighbourhood_m` of the best match; the variogram is the
/// squared difference over `unit`, to the power of `exponent`.
[[nodiscard]] KrigedPosition krige(const ResemblingViews& near, double neighbourhood_m,
                                   double exponent, double unit);

}  // namespace panonav
