#pragma once

#include <cmath>
#include <optional>

#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

/// The comparison of a view with a snapshot of a chain.
struct SnapshotSight {
  HomeVector vector;
  double difference = 2.0;  ///< of the images
  /// Mean of the correlation of the views and of the cosine of the angle between the home vectors
  /// from the view to the snapshot and back, -1 .. 1: how probably the vector is right.
  double confidence = -1.0;
};

/// Compares a view with a snapshot at headings within the window.
[[nodiscard]] inline SnapshotSight look_at_snapshot(const HomingView& snapshot,
                                                    const HomingView& view,
                                                    const std::optional<HeadingWindow>& window) {
  SnapshotSight sight;
  sight.difference = image_difference(snapshot, view);
  sight.vector = home_vector(snapshot, view, {}, window);
  std::optional<HeadingWindow> reverse_window = window;
  if (window) reverse_window->middle_rad = -window->middle_rad;
  const HomeVector reverse = home_vector(view, snapshot, {}, reverse_window);
  if (sight.vector.length() == 0.0 || reverse.length() == 0.0) return sight;
  // Both directions in the frame of the snapshot; the way back is the opposite one.
  const double there_rad = sight.vector.direction_rad() - sight.vector.heading_rad;
  const double agreement = -std::cos(there_rad - reverse.direction_rad());
  sight.confidence = 0.5 * (sight.vector.correlation + agreement);
  return sight;
}

}  // namespace panonav
