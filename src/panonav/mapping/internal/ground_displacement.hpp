#pragma once

#include <optional>

#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

/// The displacement that the ground shows, in heights of the camera above it.
struct GroundDisplacement {
  double x = 0.0;  ///< of the later robot in the frame of the earlier one
  double y = 0.0;
  double deviation = 0.0;   ///< standard deviation of the length, from the residuals
  double difference = 0.0;  ///< median difference of the pixels in both views
};

/// Estimates the displacement from level ground below the horizon. Ground at elevation -e is at the
/// distance camera height / tan e, so lengths do not depend on the distance of walls. Refines
/// `start` (before_from_after, x and y in camera heights, right to about a quarter of a camera
/// height) by robust least squares: its heading is kept, and pixels that move otherwise get low
/// weights. Objects on the ground make lengths up to 15 % too long in narrow rooms. nullopt if
/// elevations are unknown or differ, or the views have too little ground in common. Throws
/// ContractError on views of different rows. Cost: about 0.1 ms for 80 x 15.
[[nodiscard]] std::optional<GroundDisplacement> ground_displacement(const HomingView& before,
                                                                    const HomingView& after,
                                                                    const Pose2& start);

}  // namespace panonav
