#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/localisation/particle_modes.hpp"

namespace panonav {

/// How many particles of equal weight say as much: (sum w)^2 / sum w^2. 0 for no or only zero
/// weights.
[[nodiscard]] double effective_sample_size(std::span<const double> weights);

/// Indices of the particles that survive, ascending: `count` equally spaced marks over the sum of
/// the weights, with one random offset. Each particle is taken floor or ceil of count times its
/// share of the weight. One random number. Throws ContractError on a weight that is negative or not
/// finite, or no weight at all. O(weights + count).
[[nodiscard]] std::vector<std::size_t> low_variance_resample(std::span<const double> weights,
                                                             std::size_t count, Random& random);

/// Replaces the particles by `count` of them, drawn by `low_variance_resample`, with equal weights.
void resample_particles(Particles& particles, std::size_t count, Random& random);

/// The same with as many as there are, each spread within its mode by the kernel that the mode's
/// covariance and number of particles call for (a regularised particle filter).
void resample_and_spread(Particles& particles, const PoseBins& bins, Random& random);

/// Particles needed so that, with probability 0.99, the distribution over `occupied_bins` bins that
/// they stand for is within `error` (Kullback-Leibler) of the true one [Fox 2003, eq. 7]. 1 for one
/// bin. Throws ContractError unless error > 0.
[[nodiscard]] std::size_t kld_sample_size(std::size_t occupied_bins, double error);

}  // namespace panonav
