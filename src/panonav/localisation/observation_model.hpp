#pragma once

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/place_model.hpp"
#include "panonav/localisation/sample.hpp"

namespace panonav {

/// Models how the similarity between a view and a reference falls with their distance, and how
/// sharply the similarities determine a position. Learnt from the memory's posed views and stored
/// with the memory.
///
/// The similarity of two views is far_difference^2 - difference^2 (`ColumnMatch`), never below 0. A
/// view's expected similarity to a reference at distance r is amplitude * exp(-r / range_m), since
/// dissimilarity grows with distance and saturates [M04 section 2.2]. People in view, light and
/// noise lower the amplitude, so each view gets its own: only the relative similarities to the
/// references locate the robot.
struct ObservationModel {
  /// Smallest number of posed views needed for learning.
  static constexpr int min_views = 8;

  double spacing_m = 0.0;       ///< between references
  double far_difference = 0.6;  ///< median difference of two distant views
  double range_m = 0.0;         ///< distance at which the similarity has fallen to 1/e
  /// Log-likelihood of a view per unit of squared explained similarity: half the inverse
  /// variance of a similarity around its expected value.
  double sharpness = 0.0;
  double heading_width_rad =
      0.0;  ///< largest heading difference at which a reference explains a view
  /// Largest difference between a view taken at a memorised place and its best reference
  /// (`PlaceModel::threshold`).
  double explained_difference = 0.5;
  double neighbouring_difference = 0.4;  ///< expected difference of views one spacing apart
  int sampled_views = 0;                 ///< number of views from which it was learnt
  friend bool operator==(const ObservationModel&, const ObservationModel&) = default;
};

/// Learns the model by leaving views out in turn. Throws OptionError; ContractError if the memory
/// has fewer than `min_views` posed views or all of them at one position. Cost: one comparison of
/// columns for each pair of a sampled and a compared view, 0.25 s for the defaults and 1000 views;
/// plus a place model.
[[nodiscard]] ObservationModel learn_observation_model(const ColumnRanking& ranking,
                                                       const LearningOptions& options = {});
/// Learns the same with a place model that was learnt from the same views.
[[nodiscard]] ObservationModel learn_observation_model_with_places(
    const ColumnRanking& ranking, const PlaceModel& place, const LearningOptions& options = {});

}  // namespace panonav
