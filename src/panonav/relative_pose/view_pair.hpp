#pragma once

#include <cstddef>
#include <optional>

#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"

namespace panonav {

/// Relative pose of two views from their phases [M04 sections 3.4 and 3.5].
struct PhaseReading {
  double turn_rad = 0.0;         ///< heading of b minus heading of a
  double direction_a_rad = 0.0;  ///< towards b, in the frame of the robot that took a
  double direction_b_rad = 0.0;  ///< towards a, in the frame of the robot that took b
  /// Distance between the places in units of R, the typical distance of the things around.
  double length = 0.0;
  /// Each view by itself gives the direction of the other one. This is the angle between the two
  /// answers, in [0, pi]: small for neighbouring places, anything for unrelated ones.
  double disagreement_rad = 0.0;
  /// The same for the headings.
  double turn_disagreement_rad = 0.0;
  /// False for pictures of one place, where no direction is meant; directions and length are then
  /// 0.
  bool points = false;
  /// Share of the energy of both views that turn and displacement leave unexplained, 0 .. 1: the
  /// mean of both answers.
  double residual = 1.0;
};

/// Reads both ways, from a to b and back. Empty when either view has no structure. Throws
/// ContractError when the views differ in shape or have fewer than three components. Cost: that of
/// two home vectors.
/// With `window` only headings of b minus those of a within it are considered: places that look
/// alike when turned by a quarter are then not mistaken for each other; empty also when no turn
/// within them fits.
[[nodiscard]] std::optional<PhaseReading> read_phases(
    const HomingView& a, const HomingView& b,
    const std::optional<HeadingWindow>& window = std::nullopt);

}  // namespace panonav
