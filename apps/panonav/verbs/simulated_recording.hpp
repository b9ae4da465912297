#pragma once

#include "cli/arguments.hpp"
#include "experiments/runs/mission.hpp"
#include "panonav/simulation/simulated_world.hpp"

namespace panonav::command {

void declare_simulation(Arguments& arguments, SimulatedWorldOptions& wanted);
/// What the options of scene and sensor need of each other, for verbs that declare both.
void require_effects(Arguments& arguments, const SimulatedWorldOptions& wanted);

/// The options that the user typed.
[[nodiscard]] GivenOption typed_options(const Arguments& arguments);

/// The world for missions: a robot of the chosen size and sensor in it.
[[nodiscard]] MissionPlace mission_place(const SimulatedWorld& world);

}  // namespace panonav::command
