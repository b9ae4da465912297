#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Hypotheses of where the robot is, column by column as kernels take them. Invariant: columns of
/// one size. In a filter the weights sum to 1.
struct Particles {
  std::vector<double> x_m,     ///< in the frame of the memory's positions
      y_m,                     ///< in the frame of the memory's positions
      heading_rad;             ///< in [-pi, pi)
  std::vector<double> weight;  ///< >= 0

  /// Number of particles.
  [[nodiscard]] std::size_t size() const noexcept { return weight.size(); }
  /// Whether there is none.
  [[nodiscard]] bool empty() const noexcept { return weight.empty(); }
  /// Of particle i, which the caller guarantees to be there.
  [[nodiscard]] Point2 position(std::size_t i) const { return {x_m[i], y_m[i]}; }
  /// Of particle i, which the caller guarantees to be there.
  [[nodiscard]] Pose2 pose(std::size_t i) const { return {x_m[i], y_m[i], heading_rad[i]}; }
  /// Replaces particle i, which the caller guarantees to be there.
  void set(std::size_t i, const Pose2& pose, double its_weight) {
    x_m[i] = pose.x_m;
    y_m[i] = pose.y_m;
    heading_rad[i] = pose.heading_rad;
    weight[i] = its_weight;
  }
  /// Appends a particle.
  void add(const Pose2& pose, double its_weight) {
    resize(size() + 1);
    set(size() - 1, pose, its_weight);
  }
  /// Keeps the first `count`; where there are fewer, the new ones are all zeros.
  void resize(std::size_t count) {
    for (auto* column : {&x_m, &y_m, &heading_rad, &weight}) column->resize(count);
  }
};

/// Particles that lie together.
struct PoseMode {
  double weight = 0.0;  ///< sum over its particles
  Pose2 mean;           ///< weighted; the heading is the circular mean
  /// Of x, y (m) and heading (rad), row by row.
  std::array<double, 9> covariance{};
  double spread_m = 0.0;            ///< root mean square distance of the particles from the mean
  double heading_spread_rad = 0.0;  ///< the same of the headings
};

/// Bins in which particles are counted and gathered.
struct PoseBins {
  double cell_m = 0.25;  ///< side, > 0
  int headings = 24;     ///< sectors of the circle; 1: headings do not tell modes apart
};

/// The modes of a set of particles, and which particle belongs to which.
struct ParticleModes {
  std::vector<PoseMode> modes;    ///< heaviest first
  std::vector<int> mode_of;       ///< of each particle; -1: in no mode that was kept
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
