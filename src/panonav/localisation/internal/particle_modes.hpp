#pragma once

#include <cstddef>
#include <vector>

#include "panonav/localisation/particles.hpp"

namespace panonav {

/// Number of bins on each side of the heaviest one that belong to its mode.
inline constexpr int mode_reach = 2;

/// The grid in which particles are counted and clustered.
struct PoseBins {
  double cell_m = 0.25;  ///< side of a cell, > 0
  int headings = 24;     ///< sectors of the circle; 1: headings do not separate modes
};

/// The modes of a set of particles.
struct ParticleModes {
  std::vector<PoseMode> modes;    ///< heaviest first
  std::vector<int> mode_of;       ///< index of each particle's mode; -1: none
  std::size_t occupied_bins = 0;  ///< bins with at least half the mean weight of a particle
};

/// Clusters particles around the heaviest bin, then around the heaviest remaining bin, and so on. A
/// mode consists of a bin and the bins at most two steps away, except those of earlier modes. Drops
/// modes below the share `min_weight` of the total weight. Deterministic; cost linear in particles,
/// and in bins times modes.
[[nodiscard]] ParticleModes find_modes(const Particles& particles, const PoseBins& bins,
                                       double min_weight = 0.01);

}  // namespace panonav
