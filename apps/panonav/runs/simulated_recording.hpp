#pragma once

#include "cli/arguments.hpp"
#include "panonav_simulation/simulated_world.hpp"

namespace panonav::command {

void declare_simulation(Arguments& declared, simulation::SimulatedWorldOptions& arguments);
/// Rejects options of scene and sensor that have no effect without another option.
void reject_ineffective_options(Arguments& declared,
                                const simulation::SimulatedWorldOptions& arguments);

/// Returns a function that returns the flag of an option if the user has set it.
[[nodiscard]] simulation::FindSetOption make_option_lookup(const Arguments& declared);

}  // namespace panonav::command
