#pragma once

#include <array>
#include <optional>

#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

/// Number of terms of the probability of a direction.
inline constexpr int direction_term_count = 4;

/// Features of two views that show whether they have a relative pose, and whether it was found.
struct PairFeatures {
  HomeVector vector;   ///< from the current view to home
  HomeVector reverse;  ///< from home to the current view
  /// Sum of the correlations of both vectors less its mean with views of noise that have the
  /// spectrum of the current view, in standard deviations, -2 .. 10; -2 for views without structure
  /// and if all noise matches equally well, as with one frequency.
  double deviations_over_noise = -2.0;
  /// Sum of the differences of the magnitudes over the sum of the magnitudes, 0 .. 1: small for
  /// near places, whatever the headings.
  double magnitude_difference = 1.0;
  /// Correlation less that with the mirrored current view, which shows no place but has the same
  /// floor, ceiling and textures; both as inverse hyperbolic tangent.
  double excess_over_mirror = 0.0;
  /// Mean cosine between the direction of `vector` and those of the upper, middle and lower third
  /// of the rows alone, -1 .. 1; 0 for views of fewer than three rows.
  double band_agreement = 0.0;
  /// Angle between the directions of `vector` and `reverse`, 0 .. pi.
  double disagreement_rad = 0.0;

  /// True if the views are more similar than views of noise and of other buildings.
  [[nodiscard]] bool is_related() const noexcept;
  /// Probability, 0 .. 1, that the direction of `vector` is right within 45 degrees if the views
  /// are of one building. Learnt by `bench/pair_probability` (docs/results-elsewhere.md).
  [[nodiscard]] double direction_probability() const noexcept;
  /// Terms of the log-odds of that probability.
  [[nodiscard]] std::array<double, direction_term_count> direction_terms() const noexcept;
};

/// Computes the features. Throws as `home_vector`. Cost: that of about 90 home vectors of 16 rows,
/// some milliseconds.
[[nodiscard]] PairFeatures compute_pair_features(
    const HomingView& home, const HomingView& current, const FourierHomingOptions& options = {},
    const std::optional<HeadingWindow>& window = std::nullopt);

/// Returns the correlation of two views at their turn less the highest one with the mirrored
/// current view, which shows no place but has the same floor, ceiling and textures; both as inverse
/// hyperbolic tangent. Cost: less than one home vector.
[[nodiscard]] double compute_excess_over_mirror(const HomingView& home, const HomingView& current,
                                                double correlation);

/// Evidence of two views about their relative pose.
struct PairEvidence {
  /// Displacement and turn from the current view to home. No displacement at home: see
  /// `HomeVector::has_direction`. Its covariance is that of the least squares alone.
  HomeVector vector;
  /// Standard deviation of the direction of `vector`, if it is right within 45 degrees.
  double direction_deviation_rad = 0.0;
  /// Standard deviation of the turn of `vector`, if it is right within 20 degrees.
  double turn_deviation_rad = 0.0;
  /// The best solution whose turn differs from that of `vector` by more than 45 degrees: the second
  /// peak. The nearer its residual is to that of `vector`, the more ambiguous is the turn. nullopt
  /// if the views correlate at no other turn.
  std::optional<HomeVector> second;
  /// Probability, 0 .. 1, that the direction of `vector` is right within 45 degrees
  /// (`PairFeatures::direction_probability`); means nothing without a direction.
  double probability = 0.0;
};

/// Returns the best home vector whose turn differs from that of `first` by more than 45 degrees;
/// nullopt if the views correlate at no such turn. Throws and costs as `home_vector`.
[[nodiscard]] std::optional<HomeVector> find_second_vector(const HomingView& home,
                                                           const HomingView& current,
                                                           const HomeVector& first,
                                                           FourierHomingOptions options = {});

/// Computes the relative pose of two views and how probable it is. nullopt if the views do not show
/// that they have a relative pose (`PairFeatures::is_related`), for example views of two buildings,
/// noise, or views without structure. `window`: turns that are considered for `vector`; those of
/// `second` are not limited. Throws as `home_vector`. Cost: that of `compute_pair_features`.
[[nodiscard]] std::optional<PairEvidence> compute_pair_evidence(
    const HomingView& home, const HomingView& current, const FourierHomingOptions& options = {},
    const std::optional<HeadingWindow>& window = std::nullopt);

}  // namespace panonav
