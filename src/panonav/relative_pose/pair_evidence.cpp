#include "panonav/relative_pose/pair_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/internal/view_variants.hpp"

namespace panonav {

namespace {

/// Rows to which views are averaged for the comparison with noise: enough vertical structure for
/// noise of its spectrum.
constexpr int max_noise_rows = 16;
/// Number of views of noise; the standard deviation of their matches then errs by 11 %.
constexpr int noise_view_count = 40;
constexpr double max_deviations = 10.0;  ///< more deviations say no more
constexpr double min_deviations = -2.0;
/// Least share of magnitudes that differ; below it noise of pixels and rounding decide.
constexpr double min_magnitude_difference = 0.01;
/// Smallest difference of turns that are two solutions.
constexpr double min_turn_difference_rad = std::numbers::pi / 4.0;

/// The vectors from the current view to home and back.
struct VectorPair {
  HomeVector vector;
  HomeVector reverse;

  [[nodiscard]] double match() const noexcept { return vector.correlation + reverse.correlation; }
};

std::optional<HeadingWindow> reverse_window(std::optional<HeadingWindow> window) {
  if (window) window->middle_rad = -window->middle_rad;
  return window;
}

VectorPair compute_both_ways(const HomingView& home, const HomingView& current,
                             const FourierHomingOptions& options,
                             const std::optional<HeadingWindow>& window) {
  return {home_vector(home, current, options, window),
          home_vector(current, home, options, reverse_window(window))};
}

/// Returns the sum of the correlations of both vectors, as `VectorPair::match`.
double compute_match(const HomingView& home, const HomingView& current,
                     const FourierHomingOptions& options,
                     const std::optional<HeadingWindow>& window) {
  return home_vector_correlation(home, current, options, window) +
         home_vector_correlation(current, home, options, reverse_window(window));
}

double compute_deviations_over_noise(const HomingView& home, const HomingView& current,
                                     const FourierHomingOptions& options,
                                     const std::optional<HeadingWindow>& window) {
  const HomingView goal = average_to_bands(home, max_noise_rows);
  const HomingView here = average_to_bands(current, max_noise_rows);
  const NoiseGenerator noise(here);
  constexpr std::uint64_t seed = 1;
  std::vector<double> matches;
  double mean = 0.0;
  for (std::uint64_t i = 0; i < noise_view_count; ++i) {
    const HomingView sample = noise.sample_view(Random(seed, i));
    matches.push_back(compute_match(goal, sample, options, window));
    mean += matches.back() / noise_view_count;
  }
  double square = 0.0;
  for (const double match : matches) square += (match - mean) * (match - mean);
  const double deviation = std::sqrt(square / (noise_view_count - 1));
  constexpr double rounding = 1e-6;
  if (deviation <= rounding) return min_deviations;
  const double match = compute_match(goal, here, options, window);
  return std::clamp((match - mean) / deviation, min_deviations, max_deviations);
}

double compute_magnitude_difference(const HomingView& home, const HomingView& current) {
  double difference = 0.0;
  double sum = 0.0;
  for (int k = 1; k < std::min(home.components(), current.components()); ++k) {
    for (int y = 0; y < home.rows(); ++y) {
      const auto a = static_cast<double>(std::hypot(home.a(y, k), home.b(y, k)));
      const auto b = static_cast<double>(std::hypot(current.a(y, k), current.b(y, k)));
      difference += std::abs(a - b);
      sum += a + b;
    }
  }
  return sum > 0.0 ? difference / sum : 1.0;
}

double to_unbounded(double match) {
  constexpr double max_correlation = 0.999;  // coefficients have few digits
  return std::atanh(std::clamp(0.5 * match, -max_correlation, max_correlation));
}

double compute_band_agreement(const HomingView& home, const HomingView& current,
                              double direction_rad, const FourierHomingOptions& options,
                              const std::optional<HeadingWindow>& window) {
  constexpr int bands = 3;
  if (home.rows() < bands) return 0.0;
  double agreement = 0.0;
  for (int band = 0; band < bands; ++band) {
    const int first = band * home.rows() / bands;
    const int last = (band + 1) * home.rows() / bands;
    const HomeVector part = home_vector(select_rows(home, first, last),
                                        select_rows(current, first, last), options, window);
    agreement += std::cos(part.direction_rad() - direction_rad) / bands;
  }
  return agreement;
}

}  // namespace

bool PairFeatures::is_related() const noexcept {
  // Noise has as many deviations in 5 of 100 cases.
  constexpr double min_over_noise = 1.645;
  // Learnt by `bench/pair_probability`: views whose magnitudes differ by m need offset + slope ln m
  // deviations, so that 5 of 1,000 pairs of views from two buildings are taken for related.
  constexpr double offset = 8.57;
  constexpr double slope = 5.01;
  return deviations_over_noise > min_over_noise &&
         deviations_over_noise >
             offset + slope * std::log(magnitude_difference + min_magnitude_difference);
}

std::array<double, direction_term_count> PairFeatures::direction_terms() const noexcept {
  return {deviations_over_noise, excess_over_mirror, band_agreement, disagreement_rad};
}

double PairFeatures::direction_probability() const noexcept {
  // Learnt by `bench/pair_probability`, in the order of `direction_terms`.
  constexpr std::array<double, direction_term_count> coefficients{0.39, 2.48, 0.50, -0.41};
  constexpr double offset = -0.66;
  const auto terms = direction_terms();
  double log_odds = offset;
  for (std::size_t i = 0; i < terms.size(); ++i) log_odds += coefficients[i] * terms[i];
  return 1.0 / (1.0 + std::exp(-log_odds));
}

PairFeatures compute_pair_features(const HomingView& home, const HomingView& current,
                                   const FourierHomingOptions& options,
                                   const std::optional<HeadingWindow>& window) {
  const VectorPair pair = compute_both_ways(home, current, options, window);
  PairFeatures features{.vector = pair.vector, .reverse = pair.reverse};
  if (!(pair.vector.correlation > 0.0)) return features;
  features.deviations_over_noise = compute_deviations_over_noise(home, current, options, window);
  features.magnitude_difference = compute_magnitude_difference(home, current);
  features.excess_over_mirror = to_unbounded(pair.match()) -
                                to_unbounded(compute_match(home, mirror(current), options, window));
  features.band_agreement =
      compute_band_agreement(home, current, pair.vector.direction_rad(), options, window);
  features.disagreement_rad =
      std::abs(wrap_angle(pair.reverse.direction_rad() + pair.vector.heading_rad +
                          std::numbers::pi - pair.vector.direction_rad()));
  return features;
}

double compute_excess_over_mirror(const HomingView& home, const HomingView& current,
                                  double correlation) {
  const FourierHomingOptions options{.starting_estimates = 1, .displacement_search = false};
  return to_unbounded(2.0 * correlation) -
         to_unbounded(2.0 * home_vector_correlation(home, mirror(current), options));
}

std::optional<HomeVector> find_second_vector(const HomingView& home, const HomingView& current,
                                             const HomeVector& first,
                                             FourierHomingOptions options) {
  options.turn = FourierHomingOptions::TurnEstimate::global;
  const HeadingWindow others{
      .middle_rad = static_cast<float>(wrap_angle(first.heading_rad + std::numbers::pi)),
      .half_width_rad = static_cast<float>(std::numbers::pi - min_turn_difference_rad)};
  const HomeVector second = home_vector(home, current, options, others);
  return second.correlation > 0.0 ? std::optional(second) : std::nullopt;
}

std::optional<PairEvidence> compute_pair_evidence(const HomingView& home, const HomingView& current,
                                                  const FourierHomingOptions& options,
                                                  const std::optional<HeadingWindow>& window) {
  const PairFeatures features = compute_pair_features(home, current, options, window);
  if (!features.is_related()) return std::nullopt;
  // The least squares take all things to be R away and all rows as independent. Factors and the
  // remaining errors were learnt by `bench/pair_probability`.
  constexpr double direction_factor = 2.86;
  constexpr double min_direction_deviation_rad = 0.199;
  constexpr double turn_factor = 5.07;
  constexpr double turn_deviation_of_length_rad = 0.166;  // per R
  const HomeVector& vector = features.vector;
  return PairEvidence{
      .vector = vector,
      .direction_deviation_rad = std::hypot(direction_factor * vector.direction_deviation_rad(),
                                            min_direction_deviation_rad),
      .turn_deviation_rad = std::hypot(turn_factor * std::sqrt(vector.covariance[8]),
                                       turn_deviation_of_length_rad * vector.length()),
      .second = find_second_vector(home, current, vector, options),
      .probability = features.direction_probability()};
}

}  // namespace panonav
