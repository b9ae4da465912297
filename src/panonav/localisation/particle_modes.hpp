#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// One hypothesis of where the robot is. Weights of all particles sum to 1.
struct Particle {
  Pose2 pose;
  double weight = 0.0;
};

/// Particles that lie together.
struct PoseMode {
  double weight = 0.0;
  Pose2 mean;
  /// Of x, y (m) and heading (rad), row by row.
  std::array<double, 9> covariance{};
  double spread_m = 0.0;  ///< root mean square distance of the particles from the mean
  double heading_spread_rad = 0.0;
};

/// Bins in which particles are counted and gathered.
struct PoseBins {
  double cell_m = 0.25;  ///< side, > 0
  int headings = 24;     ///< sectors of the circle; 1: headings do not tell modes apart
};

struct ParticleModes {
  std::vector<PoseMode> modes;    ///< heaviest first
  std::vector<int> mode_of;       ///< of each particle; -1: in no mode that was kept
  std::size_t occupied_bins = 0;  ///< that hold more than a particle's share of the weight
};

/// Gathers particles around the heaviest bin, then around the heaviest bin of what is left, and so
/// on: a mode is a bin and the bins up to two beside it, less what was gathered before. Modes below
/// `least_weight` of the whole are not kept. Deterministic; cost linear in particles, and in bins
/// times modes.
[[nodiscard]] ParticleModes find_modes(std::span<const Particle> particles, const PoseBins& bins,
                                       double least_weight = 0.01);

/// Root mean square distance of the particles from their mean; 0 for none.
[[nodiscard]] double spread_of(std::span<const Particle> particles);

}  // namespace panonav
