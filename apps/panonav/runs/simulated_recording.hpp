#pragma once

#include "cli/arguments.hpp"
#include "panonav_simulation/simulated_world.hpp"

namespace panonav::command {

void declare_simulation(Arguments& declared, simulation::SimulatedWorldOptions& arguments);
/// Declares which options of scene and sensor depend on each other, for verbs that have both.
void require_effects(Arguments& declared, const simulation::SimulatedWorldOptions& arguments);

/// The options that the user typed.
[[nodiscard]] simulation::FindSetOption make_option_lookup(const Arguments& declared);

}  // namespace panonav::command
