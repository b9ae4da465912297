#pragma once

#include <optional>
#include <span>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/localisation/sample.hpp"

namespace panonav {

/// Parameters for interpolating positions from the differences between views of one memory. Learnt
/// from its posed views by leaving one out, and stored with it.
struct PositionModel {
  /// Smallest number of posed views needed for learning.
  static constexpr int min_views = 8;
  /// Number of best matches considered in an interpolation, before those far from the best one are
  /// dropped. More would change positions by less than their error.
  static constexpr int candidates = 16;

  /// False if there were fewer than `min_views` posed views; the position is then that of the best
  /// match.
  bool learnt = false;
  int components = 0;            ///< Fourier components compared; 0: all
  int sampled_views = 0;         ///< number of views left out in turn
  double neighbourhood_m = 0.0;  ///< references farther than this from the best match are ignored
  /// Exponent of the variogram: half the mean square distance ~ difference^(2 exponent).
  double exponent = 1.5;
  double difference_unit = 1.0;  ///< median squared difference to the nearest view
  double variance_unit = 0.0;    ///< median kriging variance
  /// Ratio of the 95 % radius to the kriging deviation if similar references surround the best
  /// match, leaving no half circle free.
  double radius_m_per_deviation = 0.0;
  /// Radius beyond the references: the place may be outside of the outermost ones.
  double edge_radius_m_per_deviation = 0.0;
  double spacing_m = 0.0;  ///< of the posed views
  /// Smallest ratio of the best match's difference to that of the best match elsewhere (more than 3
  /// spacings away) at which the position may be that of a lookalike; nullopt if that hardly
  /// happens.
  std::optional<double> ambiguous_from;
  double ambiguous_radius_m = 0.0;  ///< smallest radius at ratios of `ambiguous_from` or more
  double median_error_m = 0.0;      ///< of the views left out
  double error95_m = 0.0;           ///< 95 % quantile of the errors of the views left out
  friend bool operator==(const PositionModel&, const PositionModel&) = default;
};

/// Learns the model by leaving out each sampled view in turn: first the neighbourhood and exponent
/// with the smallest errors, then the radius that holds 95 % of the errors near the true place. If
/// more than 1 of 40 views is found at a lookalike, ambiguous views get a larger radius; they match
/// hardly better than elsewhere. The radius tends to be too large, as left-out views are farther
/// from other references than queries are. Throws OptionError. Cost: `sampled_views` searches and
/// about 1 ms for each.
[[nodiscard]] PositionModel learn_position_model(const ColumnRanking& ranking,
                                                 const LearningOptions& options = {
                                                     .sampled_views = 200});

/// Interpolates the position by ordinary kriging in the space of the views: the weighted mean of
/// the neighbouring references' positions with the smallest expected squared error. Assumes that
/// half the mean square distance between two places grows as their squared difference
/// (`ColumnMatch`) to the power of the exponent [cf. M04 section 2.2]. At a memorised view the
/// result is that view's position.
///
/// `matches`: best first, compared over the model's components; views without a pose or far from
/// the best one are ignored. nullopt if the best match has no pose. Cost: 240 comparisons of
/// columns and a dense solution, 0.7 ms.
[[nodiscard]] std::optional<PositionEstimate> interpolate_position(
    const ColumnRanking& ranking, const PositionModel& model, std::span<const RankedMatch> matches);

}  // namespace panonav
