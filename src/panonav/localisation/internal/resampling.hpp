#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/localisation/internal/particle_modes.hpp"

namespace panonav {

/// Returns (sum w)^2 / sum w^2, the number of equally weighted particles with the same variance; 0
/// if there are no weights or all are 0.
[[nodiscard]] double effective_sample_size(std::span<const double> weights);

/// Draws particles by systematic resampling: places `count` equally spaced marks on the cumulative
/// weights, with one random offset. Returns their indices, ascending; each particle is drawn floor
/// or ceil of count times its share of the weight. Uses one random number. Throws ContractError on
/// a weight that is negative or not finite, or a sum of 0. O(weights + count).
[[nodiscard]] std::vector<std::size_t> resample_systematically(std::span<const double> weights,
                                                               std::size_t count, Random& random);

/// Replaces the particles by `count` systematically resampled ones of equal weight.
void resample_particles(Particles& particles, std::size_t count, Random& random);

/// Resamples the same number of particles and adds noise to each: a Gaussian kernel with its mode's
/// variances, narrower the more particles the mode has (a regularised particle filter).
void resample_and_spread(Particles& particles, const PoseBins& bins, Random& random);

/// Returns the number of particles for which their distribution over `occupied_bins` bins is, with
/// probability 0.99, within `error` (Kullback-Leibler) of the true one [Fox 2003, eq. 7]; 1 for one
/// bin.
[[nodiscard]] std::size_t kld_sample_size(std::size_t occupied_bins, double error);

}  // namespace panonav
