#pragma once

#include <optional>

#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"

namespace panonav {

/// Relative pose of two views, read from their phases [M04 sections 3.4 and 3.5].
struct PhaseReading {
  double turn_rad = 0.0;         ///< heading of b minus heading of a
  double direction_a_rad = 0.0;  ///< towards b, in the frame of the robot that took a
  double direction_b_rad = 0.0;  ///< towards a, in the frame of the robot that took b
  /// Distance between the places in units of R, the typical distance of the things around.
  double length = 0.0;
  /// Angle between the directions that the two views show, in [0, pi]: small for neighbouring
  /// places, arbitrary for unrelated ones.
  double disagreement_rad = 0.0;
  double turn_disagreement_rad = 0.0;  ///< difference of the two readings of the turn
  /// False for views of one place; directions and length are then 0.
  bool has_direction = false;
  /// Share of the energy of both views that turn and displacement leave unexplained, 0 .. 1: the
  /// mean of both readings.
  double residual = 1.0;
  /// Normalised correlation of the views at the turn, -1 .. 1: the mean of both readings.
  double correlation = 0.0;

  /// Returns the pose of b in the frame of a, by the mean of both directions. `unit`: length of R.
  [[nodiscard]] Pose2 a_from_b(double unit = 1.0) const;
  /// The reading of the views in reverse order.
  [[nodiscard]] PhaseReading reversed() const;
};

/// Reads the home vectors from a to b and back. nullopt when a view has no structure. With
/// `window`, only turns from a to b within it are considered, so that places that look similar
/// after a quarter turn are not mistaken for each other; nullopt also if no turn in the window
/// fits. Throws ContractError when the views differ in shape or have fewer than three components.
/// Cost: that of two home vectors.
[[nodiscard]] std::optional<PhaseReading> read_phases(
    const HomingView& a, const HomingView& b,
    const std::optional<HeadingWindow>& window = std::nullopt);

}  // namespace panonav
