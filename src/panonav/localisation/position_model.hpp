#pragma once

#include <optional>
#include <span>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/place.hpp"
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
  double variance_unit = 0.0;    ///< median kriging variance
  /// Ratio of the 95 % radius to the kriging standard deviation if neighbouring references surround
  /// the best match, so that no half circle around it is empty.
  double radius_m_per_deviation = 0.0;
  /// The same ratio if a half circle is empty: the place may be outside the outermost references.
  double edge_radius_m_per_deviation = 0.0;
  double spacing_m = 0.0;  ///< of the posed views
  /// The position may be that of a lookalike if the best match's difference is at least this
  /// share of the difference of the best match elsewhere (more than 3 spacings away). nullopt if
  /// aliased views are rare.
  std::optional<double> ambiguous_from;
  double ambiguous_radius_m = 0.0;  ///< lower limit of the radius from `ambiguous_from` on
  double median_error_m = 0.0;      ///< median position error of the views left out
  double error95_m = 0.0;           ///< 95 % quantile of the errors of the views left out
  friend bool operator==(const PositionModel&, const PositionModel&) = default;
};

/// Learns the model by leaving out each sampled view in turn: first the neighbourhood and exponent
/// with the smallest position errors, then the radius that contains 95 % of the errors of views
/// found near their true place. If more than 1 of 40 views is found at a lookalike, views that
/// match hardly better than elsewhere get a larger radius. The radius tends to be too large, as
/// left-out views are farther from other references than queries are. Throws OptionError. Cost:
/// `sampled_views` searches and about 1 ms for each.
[[nodiscard]] PositionModel learn_position_model(const ColumnRanking& ranking,
                                                 const LearningOptions& options = {
                                                     .sampled_views = 200});

/// Interpolates the position by ordinary kriging in signature space: returns the weighted mean of
/// the neighbouring references' positions with the smallest expected squared error. Assumes that
/// half the mean square distance of two places is proportional to a power of their squared
/// difference (`ColumnMatch`), with the model's exponent [cf. M04 section 2.2]. If the query is a
/// memorised view, returns that view's position.
///
/// `matches`: best first, compared over the model's components; views without a pose or far from
/// the best one are ignored. nullopt if the best match has no pose. Cost: 240 comparisons of
/// columns and a dense solution, 0.7 ms.
[[nodiscard]] std::optional<PositionEstimate> interpolate_position(
    const ColumnRanking& ranking, const PositionModel& model, std::span<const RankedMatch> matches);

}  // namespace panonav
