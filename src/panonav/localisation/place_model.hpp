#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/signature/compass.hpp"

namespace panonav {

/// How much speaks for two views being of the same place. Neither figure changes when the robot
/// turns on the spot or when the light grows by one factor.
struct PlaceEvidence {
  /// -ln(1 - magnitude_correlation) - ln(1 - phase_correlation), each term within 0 .. 14.
  double value = 0.0;
  /// Cosine of the angle between the magnitudes of all rows and components, 0 .. 1: what is seen.
  double magnitude_correlation = 0.0;
  /// Normalised correlation of the two views, k >= 1, with the heading that the compass reads and
  /// every component weighted so that it counts equally on average over the memory; 0 .. 1: how it
  /// is arranged around the robot. The phases do not enter the dissimilarity, so this is
  /// independent of it.
  double phase_correlation = 0.0;
  /// Heading of the query relative to the reference; empty when one view has no structure.
  std::optional<CompassReading> compass;
};

struct PlaceModelOptions {
  int sampled_views = 300;       ///< of larger memories only so many views are used for learning
  int candidates = 10;           ///< nearest views whose evidence is looked at
  double rejected_share = 0.02;  ///< share of own queries that may be taken for unknown
  double accepted_share = 0.01;  ///< share of queries from elsewhere that may be taken for known
  int seed = 1;                  ///< of the draws
};
void visit_options(PlaceModelOptions& options, OptionVisitor& visitor);

/// The criterion that tells a place of the memory from an unknown one: the best evidence among the
/// nearest views must reach `threshold`. Plain numbers, so that it can be kept beside the memory.
struct PlaceModel {
  /// The threshold of a memory that is too small to learn from: both correlations 0.95.
  static constexpr double unlearnt_threshold = 5.9915;
  /// Both correlations 0.9975. More is never asked for: of a memory of equal views, from a robot
  /// that stood still, rounding would decide.
  static constexpr double highest_threshold = 2.0 * unlearnt_threshold;
  /// Fewest views to learn from.
  static constexpr int least_views = 8;

  double threshold = unlearnt_threshold;
  bool learnt = false;  ///< false: fewer than `least_views` views, the threshold above holds
  int sampled_views = 0;
  int candidates = 10;
  double closed_share = 0.0;   ///< share of views that have their place elsewhere in the memory too
  double genuine_low = 0.0;    ///< evidence that views of the memory reach for their neighbours
  double density_gain = 0.0;   ///< how much more it would be in a memory twice as dense
  double impostor_high = 0.0;  ///< evidence that views of different places stay below
  /// One per component; 0 for k = 0. Empty: all components count alike.
  std::vector<double> component_weights;
};

/// Throws ContractError on different shapes or weights of another number. Cost: three passes over a
/// signature.
[[nodiscard]] PlaceEvidence place_evidence(const PackedSignature& query,
                                           const PackedSignature& reference,
                                           std::span<const double> component_weights = {});

/// Learns the criterion from the memory itself; no pose, no other scene and no label is needed.
///
/// 1. Each sampled view is taken out and searched among the others: the best evidence of its
/// nearest
///    views.
/// 2. Not every view has its place elsewhere in a sparse memory. Where it has, the compass between
/// the view and
///    its two best matches and the compass between those two close a loop; chance closes 1 in 9
///    within 20 degrees. This gives the share of views for which step 1 is of the same place. The
///    others are those with the least evidence and are left out; `genuine_low` is the quantile
///    `rejected_share` of the rest.
/// 3. Queries between the references are nearer to a reference than the references are to each
/// other.
///    `density_gain` is what evidence gains when distances shrink by one such step: the mean of the
///    four best matches less the mean of the next four, which are those of the next ring of a grid
///    (median over views). Half of it is counted, because near the noise of the camera evidence
///    stops to grow.
/// 4. Pairs of views drawn at random are mostly of different places. `impostor_high` is what the
/// best
///    of `candidates` such pairs exceeds with the probability `accepted_share`, for a normal
///    distribution fitted to the median and the lower half of their evidence: the upper half also
///    holds pairs of neighbours and places that look alike.
/// 5. The threshold is genuine_low + density_gain / 2, but at most impostor_high + 1, where the
/// residuals
///    that are left are e times smaller than those strangers reach: a very dense or repetitive
///    memory must not ask for more, or light and noise that it never saw would make its own places
///    unknown.
///
/// Throws OptionError. Cost: `sampled_views` searches and 2 * `candidates` comparisons for each.
[[nodiscard]] PlaceModel learn_place_model(const VisualMemory& memory,
                                           const PlaceModelOptions& options = {});

}  // namespace panonav
