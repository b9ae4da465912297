#pragma once

#include <optional>
#include <span>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/localisation/sample.hpp"

namespace panonav {

/// Model of positions by differences of views in one memory; learnt from its posed views by
/// leaving one out. Plain numbers, to be stored with the memory.
struct PositionModel {
  /// Smallest number of posed views to learn from.
  static constexpr int min_views = 8;
  /// Best matches that may take part in an interpolation, before those far from the best one are
  /// left out. Further references change positions by less than their error.
  static constexpr int candidates = 16;

  /// False: fewer than `min_views` posed views; the answer is the nearest view's position.
  bool learnt = false;
  int components = 0;            ///< over which views were compared; 0: all
  int sampled_views = 0;         ///< that were left out in turn
  double neighbourhood_m = 0.0;  ///< references farther than this from the nearest one are left out
  /// Of the variogram: half the mean square distance ~ difference^(2 exponent).
  double exponent = 1.5;
  double difference_unit = 1.0;  ///< median squared difference to the nearest view
  double variance_unit = 0.0;    ///< median kriging variance
  /// Radius that holds 95 % over the kriging deviation, where similar references surround the
  /// nearest one: they leave no half of a circle free around it.
  double radius_m_per_deviation = 0.0;
  /// Radius beyond the references: the place may be outside of the outermost ones.
  double edge_radius_m_per_deviation = 0.0;
  double spacing_m = 0.0;  ///< of the posed views
  /// From this ratio on, of the best match's difference to that of the best match elsewhere (more
  /// than 3 spacings from it), the answer may be the wrong one of two places that look alike;
  /// nullopt where that hardly happens.
  std::optional<double> ambiguous_from;
  double ambiguous_radius_m = 0.0;  ///< smallest radius from the ratio `ambiguous_from` on
  double median_error_m = 0.0;      ///< of the views left out
  double error95_m = 0.0;           ///< 95 % of the views left out were nearer
  friend bool operator==(const PositionModel&, const PositionModel&) = default;
};

/// Learns the neighbourhood and the exponent that locate the views of the memory best when each is
/// left out in turn, and then the radius that holds 95 % of the errors of those found near their
/// place. If more than 1 of 40 was found elsewhere, in a place that looks alike, those are
/// recognised by how little better they match than elsewhere, and have a radius of their own. Views
/// left out are farther from the other references than queries are, so the radius rather holds too
/// many. Throws OptionError. Cost: `sampled_views` searches and about 1 ms for each.
[[nodiscard]] PositionModel learn_position_model(const ColumnRanking& ranking,
                                                 const LearningOptions& options = {
                                                     .sampled_views = 200});

/// Ordinary kriging in the space of the views: the position is the weighted mean of the
/// neighbouring references' positions whose expected squared error is smallest, if half the mean
/// square distance between two places grows as the square of their views' difference
/// (`ColumnMatch`) to the power of the exponent [cf. M04 section 2.2]. At a memorised view the
/// result is that view's position.
///
/// `matches`: the best first, over as many components as the model was learnt over; views without a
/// pose and views far from the best one are left out. nullopt if the best view has no pose. Cost:
/// 240 comparisons of columns and a dense solution, 0.7 ms.
[[nodiscard]] std::optional<PositionEstimate> interpolate_position(
    const ColumnRanking& ranking, const PositionModel& model, std::span<const RankedMatch> matches);

}  // namespace panonav
