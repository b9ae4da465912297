#pragma once

#include <array>
#include <optional>
#include <span>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/localisation/reference_layout.hpp"
#include "panonav/localisation/sample.hpp"

namespace panonav {

/// Parameters for interpolating positions from differences between views. Learnt from the posed
/// views of one memory by leaving each out in turn, and stored with the memory.
struct PositionModel {
  /// Smallest number of posed views needed for learning.
  static constexpr int min_views = 8;
  /// Number of best matches considered in an interpolation, before those far from the best one are
  /// dropped. More would change positions by less than their error.
  static constexpr int max_candidates = 16;

  /// False if there were fewer than `min_views` posed views; the position is then that of the best
  /// match.
  bool learnt = false;
  int components = 0;            ///< Fourier components compared; 0: all
  int sampled_views = 0;         ///< number of views left out in turn
  double neighbourhood_m = 0.0;  ///< radius around the best match within which references are used
  /// Exponent of the variogram: half the mean square distance of two places is proportional to
  /// difference^(2 exponent).
  double exponent = 1.5;
  double difference_unit = 1.0;  ///< median squared difference to the nearest view
  double spacing_m = 0.0;        ///< of the posed views
  /// The position may be that of a lookalike if the best match's difference is at least this
  /// share of the difference of the best match elsewhere (more than 3 spacings away). nullopt if
  /// aliased views are rare.
  std::optional<double> ambiguous_from;
  double ambiguous_radius_m = 0.0;  ///< lower limit of all bounds from `ambiguous_from` on
  /// How views change with distance: squared differences of views that are about `distance_m`
  /// apart. None is smaller than at a smaller distance.
  struct Change {
    double distance_m = 0.0;                ///< distance of the views
    double squared_difference = 0.0;        ///< median
    double small_squared_difference = 0.0;  ///< exceeded by 95 % of the views
    friend bool operator==(const Change&, const Change&) = default;
  };
  std::array<Change, 10> changes{};  ///< ascending by distance; all 0: not learnt
  /// 95 % quantile of squared position error over kriging variance, of the views left out that
  /// others surround; nullopt if there are fewer than `min_views` of them.
  std::optional<double> area_error_ratio;
  /// Median of the errors along the line where the other views form a line; nullopt likewise.
  std::optional<double> line_error_m;
  double median_error_m = 0.0;  ///< median position error of the views left out
  double error95_m = 0.0;       ///< 95 % quantile of the errors of the views left out
  friend bool operator==(const PositionModel&, const PositionModel&) = default;
};

/// Learns the model by leaving out each sampled view in turn: the neighbourhood and exponent with
/// the smallest position errors, how large these are, and how views change with distance. If more
/// than 1 of 40 views is found at a lookalike, views that match hardly better than elsewhere get
/// larger bounds. Throws OptionError. Cost: `sampled_views` searches and about 1 ms for each.
[[nodiscard]] PositionModel learn_position_model(const ColumnRanking& ranking,
                                                 const LearningOptions& options = {
                                                     .sampled_views = 200});

/// Number of terms in the bound of a position.
inline constexpr int bound_term_count = 3;
/// Returns the regression terms of the logarithm of a 95 % bound along a line, in spacings: 1 and
/// the logarithms of two lengths in spacings: the distance at which views differ as much as the
/// query from its best match (plus 0.1 for noise), and the median error of the views left out (0.02
/// to 1). `bench/position_bound` learns the coefficients on built-in scenes, because a view left
/// out is never beside the line (docs/decisions.md). nullopt if the model has no error on lines.
[[nodiscard]] std::optional<std::array<double, bound_term_count>> bound_terms(
    const PositionModel& model, double difference);

/// Interpolates the position by ordinary kriging in signature space: returns the weighted mean of
/// the neighbouring references' positions with the smallest expected squared error, if half the
/// mean square distance of two places is proportional to a power of their squared difference [cf.
/// M04 section 2.2]. A memorised view gets its own position.
///
/// Radius: where views surround the best match, from the kriging variance (`area_error_ratio`);
/// elsewhere the distance beyond which 95 % of the views differ more than the query from it.
/// `layout`: of the memory. `matches`: best first; only posed ones near the first count.
/// `excluded`: not part of the layout. `is_place_certain`: ignore `ambiguous_from`. nullopt if the
/// best match has no pose. Cost: 240 comparisons of columns, 0.7 ms.
[[nodiscard]] std::optional<PositionEstimate> interpolate_position(
    const ColumnRanking& ranking, const PositionModel& model, const ReferenceLayout& layout,
    std::span<const RankedMatch> matches, std::span<const ViewId> excluded = {},
    bool is_place_certain = false);

}  // namespace panonav
