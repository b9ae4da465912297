#pragma once

#include "panonav/geometry/pose2.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// Puts a screen onto the floor: thin, upright, its middle at `across`, at right angles to the
/// heading there. Sizes > 0.
void add_screen(Scene& scene, const Pose2& across, double width_m, double height_m);

}  // namespace panonav::simulation
