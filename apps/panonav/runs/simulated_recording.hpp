#pragma once

#include <string>

#include "cli/arguments.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav_simulation/simulated_world.hpp"

namespace panonav::command {

void declare_simulation(Arguments& declared, simulation::SimulatedWorldOptions& arguments);
/// Rejects options of scene and sensor that have no effect without another option.
void reject_ineffective_options(Arguments& declared,
                                const simulation::SimulatedWorldOptions& arguments);
/// Rejects these and options of the camera that have no effect on its kind.
void reject_ineffective_camera_options(Arguments& declared,
                                       const simulation::SimulatedWorldOptions& arguments);

/// Returns a function that returns the flag of an option if the user has set it.
[[nodiscard]] simulation::FindSetOption make_option_lookup(const Arguments& declared);

/// Parses the value "X,Y,HEADING_DEG" of a flag. Throws UsageError, also if the robot cannot be
/// there.
[[nodiscard]] Pose2 parse_free_pose(const std::string& flag, const std::string& text,
                                    const simulation::FreeSpace& space);

}  // namespace panonav::command
