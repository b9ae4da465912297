#pragma once

#include "panonav/core/portable_math.hpp"
#include "panonav/relative_pose/home_vector.hpp"
#include "panonav/route/chain_pilot.hpp"

namespace panonav {

/// Headings at which views, turned to heading 0, are compared while recording: as far as a
/// follower's may be off.
inline constexpr HeadingWindow compared_headings{0.0F, 0.8F};

/// Returns how confident a robot in a home area is of a home vector; -1 if it does not use it.
/// Beside a snapshot, where vectors have no direction, the similarity of the images decides.
[[nodiscard]] inline double usable_confidence(double confidence, double difference,
                                              const ChainModel& model) {
  if (difference <= static_cast<double>(model.arrived_difference)) return 2.0 - difference;
  return confidence >= static_cast<double>(model.homing_confidence) ? confidence : -1.0;
}

/// Compares a view with a snapshot at headings within the window.
[[nodiscard]] inline SnapshotSight look_at_snapshot(const CoefficientView& snapshot,
                                                    const CoefficientView& view,
                                                    const HeadingWindow& window) {
  SnapshotSight sight;
  sight.difference = find_difference(snapshot, view);
  sight.vector = find_home_vector(snapshot, view, {}, window);
  const HomeVector reverse =
      find_home_vector(view, snapshot, {}, {-window.middle_rad, window.half_width_rad});
  if (sight.vector.length() == 0.0 || reverse.length() == 0.0) return sight;
  // Both directions in the frame of the snapshot; the way back is the opposite one.
  const double there_rad = sight.vector.direction_rad() - sight.vector.heading_rad;
  const double agreement = -portable::cos(there_rad - reverse.direction_rad());
  sight.confidence = 0.5 * (sight.vector.correlation + agreement);
  return sight;
}

}  // namespace panonav
