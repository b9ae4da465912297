#pragma once

#include "panonav/geometry/pose2.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// Adds a thin upright screen on the floor, centred at `across` and perpendicular to its heading.
/// Sizes > 0.
void add_screen(Scene& scene, const Pose2& across, double width_m, double height_m);

}  // namespace panonav::simulation
