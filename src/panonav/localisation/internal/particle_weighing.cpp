#include "panonav/localisation/internal/particle_weighing.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/kernels/similarity.hpp"
#include "panonav/localisation/internal/resampling.hpp"

namespace panonav {

namespace {

// Stages of one view; the last one takes all that is left of it. Chosen.
constexpr int max_stages = 6;
// Particles that stand for one mode in three dimensions, at which a stage stops: chosen, the
// default of `MonteCarloOptions::min_particles`. Of few particles a third counts.
constexpr double min_effective_sample_size = 200.0;
constexpr double min_effective_share = 1.0 / 3.0;
// Halvings in the search for a stage's exponent, and its least share of what is left: chosen.
constexpr int exponent_halvings = 6;
constexpr double min_exponent_share = 1.0 / 64.0;
// What is left of the exponent is rounding below this.
constexpr double exponent_tolerance = 1e-9;
// Below this sum of weights, all particles that explain the view had lost their weight: the least
// exponential of the kernel is 1e-38.
constexpr double min_weight_sum = 1e-37;
// From this exponent on, the stages tell more of a view's likelihood than the first particles do,
// which may all miss a narrow maximum: chosen.
constexpr double min_telling_exponent = 0.2;

}  // namespace

double ParticleWeighing::take_log_ratios(const Particles& particles, ViewLikelihood& likelihood) {
  log_ratios_.resize(particles.size());
  likelihood.log_ratios(particles, log_ratios_);
  const double largest = *std::ranges::max_element(log_ratios_);
  log_ratios_below_max_.resize(log_ratios_.size());
  std::ranges::transform(log_ratios_, log_ratios_below_max_.begin(),
                         [largest](double ratio) { return static_cast<float>(ratio - largest); });
  return largest;
}

ParticleWeighing::WeightSums ParticleWeighing::make_factors(const Particles& particles,
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
  const WeightSums sums = make_factors(particles, largest);
  if (is_large_enough(sums)) return sums;
  double low = 0.0;
  double high = largest;
  for (int i = 0; i < exponent_halvings; ++i) {
    const double middle = 0.5 * (low + high);
    (is_large_enough(make_factors(particles, middle)) ? low : high) = middle;
  }
  exponent = std::max(low, min_exponent_share * largest);
  return make_factors(particles, exponent);
}

double ParticleWeighing::weigh(Particles& particles, ViewLikelihood& likelihood, double exponent,
                               const PoseBins& bins, Random& random) {
  double evidence = 0.0;
  double evidence_of_first = 0.0;
  double left = exponent;
  for (int stage = 0; stage < max_stages; ++stage) {
    const double largest = take_log_ratios(particles, likelihood);
    if (stage == 0) {
      evidence_of_first = largest + std::log(make_factors(particles, 1.0).weights);
    }
    double part = left;
    const bool is_last = stage + 1 == max_stages;
    const double sum = (is_last ? make_factors(particles, part)
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
    likelihood.arrange(particles);
  }
  return exponent >= min_telling_exponent ? std::max(evidence_of_first, evidence / exponent)
                                          : evidence_of_first;
}

}  // namespace panonav
