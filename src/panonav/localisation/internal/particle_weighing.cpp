#include "panonav/localisation/internal/particle_weighing.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/kernels/similarity.hpp"
#include "panonav/localisation/internal/resampling.hpp"

namespace panonav {

namespace {

/// Largest number of stages of one view; the last stage uses the rest of the exponent. Chosen by
/// the rooms of tests/localisation/monte_carlo_test.cpp, where no view needs more.
constexpr int max_stages = 6;
/// Smallest effective sample size after a stage: the number of particles that represent one mode in
/// three dimensions (default of `MonteCarloOptions::min_particles`), or a third of the particles if
/// they are few.
constexpr double min_effective_sample_size = 200.0;
constexpr double min_effective_share = 1.0 / 3.0;
/// Number of bisections in the search for a stage's exponent: accurate to 1/64 of the rest.
constexpr int exponent_halvings = 6;
/// Smallest share of the remaining exponent that a stage takes: the resolution of the search.
constexpr double min_exponent_share = 1.0 / 64.0;
/// A smaller rest of the exponent is due to rounding.
constexpr double exponent_tolerance = 1e-9;
/// Smallest sum of weights; below it no particle explains the view. The kernel's smallest
/// exponential is 1e-38.
constexpr double min_weight_sum = 1e-37;
/// Smallest exponent at which the evidence of the stages is used, extrapolated at most fivefold.
/// The evidence of the first particles alone may be too small, if all of them miss a narrow
/// maximum.
constexpr double min_evidence_exponent = 0.2;

}  // namespace

double ParticleWeighing::update_log_ratios(const Particles& particles, PoseLikelihood& likelihood) {
  log_ratios_.resize(particles.size());
  likelihood.compute_log_ratios(particles, log_ratios_);
  const double largest = *std::ranges::max_element(log_ratios_);
  log_ratios_below_max_.resize(log_ratios_.size());
  std::ranges::transform(log_ratios_, log_ratios_below_max_.begin(),
                         [largest](double ratio) { return static_cast<float>(ratio - largest); });
  return largest;
}

ParticleWeighing::WeightSums ParticleWeighing::update_factors(const Particles& particles,
                                                              double exponent) {
  factors_.resize(log_ratios_.size());
  kernels::exponentials(log_ratios_below_max_, static_cast<float>(exponent), factors_,
                        kernels::chosen_instructions());
  WeightSums sums;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const double weight = particles.weight[i] * static_cast<double>(factors_[i]);
    sums.weights += weight;
    sums.squares += weight * weight;
  }
  return sums;
}

ParticleWeighing::WeightSums ParticleWeighing::temper_to_min_effective_sample_size(
    const Particles& particles, double& exponent) {
  const double min_size = std::min(min_effective_sample_size,
                                   min_effective_share * static_cast<double>(particles.size()));
  const auto is_large_enough = [&](const WeightSums& sums) {
    return sums.weights * sums.weights >= min_size * sums.squares;
  };
  const double largest = exponent;
  const WeightSums sums = update_factors(particles, largest);
  if (is_large_enough(sums)) return sums;
  double low = 0.0;
  double high = largest;
  for (int i = 0; i < exponent_halvings; ++i) {
    const double middle = 0.5 * (low + high);
    (is_large_enough(update_factors(particles, middle)) ? low : high) = middle;
  }
  exponent = std::max(low, min_exponent_share * largest);
  return update_factors(particles, exponent);
}

double ParticleWeighing::update_weights(Particles& particles, PoseLikelihood& likelihood,
                                        double exponent, const PoseBins& bins, Random& random) {
  double evidence = 0.0;
  double evidence_of_first = 0.0;
  double left = exponent;
  for (int stage = 0; stage < max_stages; ++stage) {
    const double largest = update_log_ratios(particles, likelihood);
    if (stage == 0) {
      evidence_of_first = largest + std::log(update_factors(particles, 1.0).weights);
    }
    double part = left;
    const bool is_last = stage + 1 == max_stages;
    const double sum = (is_last ? update_factors(particles, part)
                                : temper_to_min_effective_sample_size(particles, part))
                           .weights;
    if (!(sum > min_weight_sum)) {
      std::ranges::fill(particles.weight, 1.0 / static_cast<double>(particles.size()));
      return evidence_of_first;
    }
    for (std::size_t i = 0; i < particles.size(); ++i) {
      particles.weight[i] *= static_cast<double>(factors_[i]) / sum;
    }
    evidence += part * largest + std::log(sum);
    left -= part;
    if (!(left > exponent_tolerance)) break;
    resample_and_spread(particles, bins, random);
    likelihood.reorder(particles);
  }
  return exponent >= min_evidence_exponent ? std::max(evidence_of_first, evidence / exponent)
                                           : evidence_of_first;
}

}  // namespace panonav
