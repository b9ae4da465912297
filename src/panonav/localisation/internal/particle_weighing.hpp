#pragma once

#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/localisation/internal/particle_modes.hpp"
#include "panonav/localisation/internal/pose_likelihood.hpp"

namespace panonav {

/// Weights particles by views, in several stages if a single one would leave only few effective
/// particles: after each stage they are resampled and spread (progressive correction of a
/// regularised particle filter; Musso, Oudjane and Le Gland 2001). Reuses its buffers from view to
/// view.
class ParticleWeighing {
 public:
  /// Multiplies the weights by the likelihood of an image, to the power of
  /// `exponent`, > 0 and <= 1, and normalises them. Returns the logarithm of the mean likelihood
  /// relative to an image that says nothing. The particles must be in the order of
  /// `PoseLikelihood::reorder`. `bins`: grid of the modes within which particles are
  /// spread.
  double update_weights(Particles& particles, PoseLikelihood& likelihood, double exponent,
                        const PoseBins& bins, Random& random);

 private:
  /// Sums over the particles with multiplied weights.
  struct WeightSums {
    double weights = 0.0;
    double squares = 0.0;
  };
  /// Computes the log-likelihoods at the particles; returns the largest one.
  double update_log_ratios(const Particles& particles, PoseLikelihood& likelihood);
  /// Computes the factors by which the likelihood to the power of `exponent` multiplies the
  /// weights.
  WeightSums update_factors(const Particles& particles, double exponent);
  /// Lowers `exponent` until the effective sample size is large enough, and computes the factors.
  WeightSums temper_to_min_effective_sample_size(const Particles& particles, double& exponent);

  std::vector<double> log_ratios_;           // of the particles
  std::vector<float> log_ratios_below_max_;  // the same less the largest of them
  std::vector<float> factors_;               // of their weights
};

}  // namespace panonav
