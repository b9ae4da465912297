#pragma once

#include <cstddef>
#include <vector>

#include "panonav/localisation/particles.hpp"

namespace panonav {

/// The grid in which particles are counted and clustered.
struct PoseBins {
  double cell_m = 0.25;  ///< side, > 0
  int headings = 24;     ///< sectors of the circle; 1: headings do not separate modes
};

/// The modes of a set of particles.
struct ParticleModes {
  std::vector<PoseMode> modes;    ///< heaviest first
  std::vector<int> mode_of;       ///< of each particle; -1: of none that was kept
  std::size_t occupied_bins = 0;  ///< that hold more than a particle's share of the weight
};

/// Clusters particles around the heaviest bin, then around the heaviest bin of the rest, and so on:
/// a mode is a bin and the bins up to two beside it, without those of earlier modes. Modes below
/// `min_weight` of the whole are not kept. Deterministic; cost linear in particles, and in bins
/// times modes.
[[nodiscard]] ParticleModes find_modes(const Particles& particles, const PoseBins& bins,
                                       double min_weight = 0.01);

/// Root mean square distance of the particles from their mean; 0 for none.
[[nodiscard]] double position_spread_m(const Particles& particles);

}  // namespace panonav
