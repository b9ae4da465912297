#pragma once

#include "cli/arguments.hpp"
#include "panonav_simulation/simulated_world.hpp"

namespace panonav::command {

void declare_simulation(Arguments& arguments, simulation::SimulatedWorldOptions& wanted);
/// What the options of scene and sensor need of each other, for verbs that declare both.
void require_effects(Arguments& arguments, const simulation::SimulatedWorldOptions& wanted);

/// The options that the user typed.
[[nodiscard]] simulation::FindSetOption typed_options(const Arguments& arguments);

}  // namespace panonav::command
