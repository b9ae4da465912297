#pragma once

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/sample.hpp"

namespace panonav {

/// Similarity of the views of one memory by their distance, and how well it determines a position.
/// Plain numbers, learnt from the memory's posed views, to be stored with it.
///
/// The similarity of two views is far_difference^2 - difference^2 (`ColumnMatch`), never below 0. A
/// view's similarity to references at the distance r of its place is expected as
/// amplitude * exp(-r / range_m): [M04 section 2.2] the dissimilarity grows with distance and
/// saturates. The amplitude is how well the view as a whole is explained; people in view, light
/// and noise lower it, so it is free, and only the pattern over the references places the robot.
struct ObservationModel {
  /// Smallest number of posed views to learn from.
  static constexpr int min_views = 8;

  double spacing_m = 0.0;       ///< between references
  double far_difference = 0.6;  ///< median difference of two views far from each other
  double range_m = 0.0;         ///< distance at which the similarity has fallen to 1/e
  /// Half the inverse square of the deviation of a similarity from its expectation: log-likelihood
  /// for each squared unit of similarity explained.
  double sharpness = 0.0;
  double heading_width_rad = 0.0;  ///< headings that differ by more do not explain a view
  /// A view of the memory's places differs by less from the best reference
  /// (`PlaceModel::threshold`).
  double explained_difference = 0.5;
  double neighbouring_difference = 0.4;  ///< expected between references one spacing apart
  int sampled_views = 0;                 ///< from which it was learnt
  friend bool operator==(const ObservationModel&, const ObservationModel&) = default;
};

/// Learns the model by leaving views out in turn, and a place model. Throws OptionError, and
/// ContractError on a memory with fewer than `min_views` posed views or with all of them in one
/// place. Cost: one comparison of columns for each pair of a sampled and a compared view, 0.25 s
/// for the defaults and a memory of 1000 views; and a place model.
[[nodiscard]] ObservationModel learn_observation_model(const ColumnRanking& ranking,
                                                       const LearningOptions& options = {});

}  // namespace panonav
