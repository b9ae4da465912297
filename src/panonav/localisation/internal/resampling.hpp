#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/localisation/internal/particle_modes.hpp"

namespace panonav {

/// Number of particles of equal weight with the same variance: (sum w)^2 / sum w^2. 0 for no or
/// only zero weights.
[[nodiscard]] double effective_sample_size(std::span<const double> weights);

/// Draws particles by systematic resampling: `count` equally spaced marks over the sum of the
/// weights, with one random offset. Returns their indices, ascending; each particle is drawn floor
/// or ceil of count times its share of the weight. Uses one random number. Throws ContractError on
/// a weight that is negative or not finite, or a sum of 0. O(weights + count).
[[nodiscard]] std::vector<std::size_t> resample_systematically(std::span<const double> weights,
                                                               std::size_t count, Random& random);

/// Replaces the particles by `count` systematically resampled ones of equal weight.
void resample_particles(Particles& particles, std::size_t count, Random& random);

/// Replaces the particles by as many, each spread within its mode by the kernel for the mode's
/// covariance and number of particles (a regularised particle filter).
void resample_and_spread(Particles& particles, const PoseBins& bins, Random& random);

/// Number of particles with which, with probability 0.99, their distribution over `occupied_bins`
/// bins is within `error` (Kullback-Leibler) of the true one [Fox 2003, eq. 7]. 1 for one bin.
/// Throws ContractError unless error > 0.
[[nodiscard]] std::size_t kld_sample_size(std::size_t occupied_bins, double error);

}  // namespace panonav
