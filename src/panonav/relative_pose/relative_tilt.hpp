#pragma once

#include <memory>

#include "panonav/panorama/tilt.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

/// Estimates the tilt of the robot at the current view relative to its tilt at home: the tilt with
/// which `level_panorama` makes the current view most similar to the home view. A turn and a
/// displacement are fitted at the same time (docs/equations.md). `heading_rad`:
/// HomeVector::heading_rad of the two views, right to about 10 degrees. Returns no tilt if
/// elevations are unknown or differ, or if the views have fewer than 10 rows. Cost: 1 ms for 40
/// rows.
[[nodiscard]] Tilt relative_tilt(const HomingView& home, const HomingView& current,
                                 double heading_rad);

/// Estimates the tilts of one current view relative to several home views: the computations that
/// depend on the current view alone are done once.
class TiltEstimator {
 public:
  /// Prepares the current view.
  explicit TiltEstimator(const HomingView& current);
  ~TiltEstimator();
  TiltEstimator(const TiltEstimator&) = delete;
  TiltEstimator& operator=(const TiltEstimator&) = delete;

  /// Returns the tilt of `relative_tilt`.
  [[nodiscard]] Tilt tilt_from(const HomingView& home, double heading_rad) const;

 private:
  struct Stages;
  std::unique_ptr<const Stages> stages_;  // null: elevations are unknown, or there are few rows
};

/// Makes the panorama of all components of a view, with enough columns that interpolation hardly
/// damps the highest frequency.
[[nodiscard]] Panorama synthesise(const HomingView& view);

/// Returns the view without the tilt, with the same components. Cost: 0.2 ms for 40 rows and 20
/// components.
[[nodiscard]] HomingView level_view(const HomingView& view, const Tilt& tilt);

}  // namespace panonav
