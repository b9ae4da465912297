#pragma once

#include <optional>

#include "panonav/core/options.hpp"
#include "panonav/localisation/column_ranking.hpp"

namespace panonav {

struct PlaceModelOptions {
  int sampled_views = 40;     ///< that are compared with others; all of smaller memories
  int compared_views = 1000;  ///< with which each is compared; all of smaller memories
  int seed = 1;               ///< of the draws
};
void visit_options(PlaceModelOptions& options, OptionVisitor& visitor);

/// The criterion that tells a place of the memory from an unknown one: the difference of the best
/// match column by column (`ColumnMatch`) must not exceed `threshold`. Plain numbers, so that it
/// can be kept beside the memory.
struct PlaceModel {
  /// Places that have nothing to do with each other differ by at least this in scenes of all kinds
  /// (docs/decisions.md); what a place with views unlike each other might suggest beyond is not
  /// taken.
  static constexpr double unrelated_difference = 0.58;
  /// The threshold of a memory that is too small to learn from.
  static constexpr double unlearnt_threshold = 0.5;
  /// Share of the difference between arbitrary views of the memory at which two views begin to have
  /// something to do with each other.
  static constexpr double related_share = 0.88;
  /// Fewest views to learn from.
  static constexpr int min_views = 8;

  double threshold = unlearnt_threshold;
  bool learnt = false;  ///< false: fewer than `min_views` views
  int sampled_views = 0;
  double neighbouring = 0.0;  ///< median difference of a view to the most similar one of all others
  double arbitrary = 0.0;     ///< median difference between two views
  double mirrored = 0.0;      ///< median difference of a mirrored view to the most similar one
  /// Nine of ten views differ by no more from the one taken nearest to them; empty where fewer than
  /// `min_views` of the sampled views have a position.
  std::optional<double> beside;
  friend bool operator==(const PlaceModel&, const PlaceModel&) = default;
};

/// Learns the criterion from the memory itself; no other scene and no label is needed.
///
/// A view mirrored left to right shows a place that does not exist, with all the brightness, edges
/// and textures of this memory: what its best match reaches by chance, a place elsewhere reaches
/// too. A query between the references is nearer to one of them than they are to each other. So the
/// threshold lies in the middle between what a view of the memory reaches among all others and what
/// a mirrored one does (medians). In a place that is its own mirror image, a corridor, mirrored
/// views do find their match, and this says nothing; therefore the threshold is at least
/// `related_share` of the median difference between arbitrary views, as far as that stays below
/// `unrelated_difference` and, where positions are known, below `beside`.
///
/// Throws OptionError. Cost: two comparisons of columns for each pair of a sampled and a compared
/// view: 0.2 s for the defaults and a memory of 1000 views.
[[nodiscard]] PlaceModel learn_place_model(const ColumnRanking& ranking,
                                           const PlaceModelOptions& options = {});

}  // namespace panonav
