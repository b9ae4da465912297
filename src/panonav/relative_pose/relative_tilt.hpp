#pragma once

#include "panonav/panorama/tilt.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

/// Estimates the tilt of the robot at the current view against that at home: the tilt with which
/// `level_panorama` makes the current view most similar to the home view, while a turn and a
/// displacement explain the rest (docs/equations.md). `heading_rad` is
/// HomeVector::heading_rad of the two, right to some 10 degrees. No tilt where elevations are
/// unknown or other than those of home, or where the views have fewer than 10 rows. Cost: 1 ms for
/// 40 rows.
[[nodiscard]] Tilt relative_tilt(const HomingView& home, const HomingView& current,
                                 double heading_rad);

/// Returns the view without the tilt, with the same components. Cost: 0.2 ms for 40 rows and 20
/// components.
[[nodiscard]] HomingView level_view(const HomingView& view, const Tilt& tilt);

}  // namespace panonav
