#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "lab/experiments.hpp"
#include "lab/runs/homing_run.hpp"
#include "panonav/core/executor.hpp"

namespace panonav::lab {

/// A run home counts as a success when the robot says that it arrived, this near.
inline constexpr double homing_success_m = 0.1;
/// Starts lie within this distance of their goal.
inline constexpr double homing_start_radius_m = 1.5;

/// Returns why a run home failed, for people: "an obstacle stopped it", "stopped at another local
/// minimum and says so". Empty for a success.
[[nodiscard]] std::string explain_failure(const HomingRun& run);

/// Measures runs home in the Gazebo world `name`, from `context.options.starts` random starts
/// around random goals. Adds rows "s06.world.NAME.*": success from all starts and from those in
/// sight of the goal, wrong arrivals that were noticed, and success of the published rule. Draws a
/// map of all runs, and one of each failure with its reason. Same arguments: same rows and images
/// on any number of threads. Throws FileError, ContractError.
void reproduce_homing_in_world(const std::string& name, const Experiments& context);

/// Measures the same over built-in scenes of several seeds: office, lab, hall, loop and garden, the
/// robot on flat ground and tilted by up to 3 degrees in a random direction at each view, and a
/// holonomic robot; and how much views differ where runs end at home and where they end elsewhere:
/// `HomingPursuitOptions::arrived_difference` is to stand between.
void reproduce_homing_in_scenes(int starts, const Experiments& context);

}  // namespace panonav::lab
