#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Weighted pose hypotheses (particles), stored column by column for the kernels. Invariant: all
/// columns have the same size. In a filter the weights sum to 1.
struct Particles {
  std::vector<double> x_m,     ///< in the frame of the memory's positions
      y_m,                     ///< in the frame of the memory's positions
      heading_rad;             ///< in [-pi, pi)
  std::vector<double> weight;  ///< >= 0

  /// Number of particles.
  [[nodiscard]] std::size_t size() const noexcept { return weight.size(); }
  /// True if there are no particles.
  [[nodiscard]] bool empty() const noexcept { return weight.empty(); }
  /// Returns the position of particle i < size().
  [[nodiscard]] Point2 position(std::size_t i) const { return {x_m[i], y_m[i]}; }
  /// Returns the pose of particle i < size().
  [[nodiscard]] Pose2 pose(std::size_t i) const { return {x_m[i], y_m[i], heading_rad[i]}; }
  /// Replaces particle i < size().
  void set(std::size_t i, const Pose2& pose, double new_weight) {
    x_m[i] = pose.x_m;
    y_m[i] = pose.y_m;
    heading_rad[i] = pose.heading_rad;
    weight[i] = new_weight;
  }
  /// Appends a particle.
  void add(const Pose2& pose, double new_weight) {
    resize(size() + 1);
    set(size() - 1, pose, new_weight);
  }
  /// Keeps the first `count` particles; added ones are all zeros.
  void resize(std::size_t count) {
    for (auto* column : {&x_m, &y_m, &heading_rad, &weight}) column->resize(count);
  }
};

/// Returns the root mean square distance of the particles from their mean; 0 for none.
[[nodiscard]] double position_spread_m(const Particles& particles);

/// A cluster of particles.
struct PoseMode {
  double weight = 0.0;                 ///< sum over the cluster's particles
  Pose2 mean;                          ///< weighted mean; circular for the heading
  std::array<double, 9> covariance{};  ///< of x, y (m) and heading (rad), row by row
  double spread_m = 0.0;               ///< root mean square distance from the mean
  double heading_spread_rad = 0.0;     ///< the same of the headings
  std::string floor;                   ///< in whose frame the mean is (`Tracker`); may be empty
};

}  // namespace panonav
