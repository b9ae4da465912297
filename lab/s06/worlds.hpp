#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "lab/experiments.hpp"
#include "lab/runs/homing_run.hpp"
#include "panonav/core/executor.hpp"

namespace panonav::lab {

/// Distance from the goal within which a reported arrival is a success.
inline constexpr double homing_success_m = 0.1;
/// Largest distance of starts from their goals.
inline constexpr double homing_start_radius_m = 1.5;

/// Returns in words why a homing run failed: "an obstacle stopped it", "another local minimum and
/// says so", ... with the distance; empty for a success.
[[nodiscard]] std::string explain_failure(const HomingRun& run);

/// Measures homing runs in the Gazebo world `name` from `context.options.starts` random starts
/// around random goals. Adds rows "s06.world.NAME.*": success from all starts and from those in
/// sight of the goal, ends elsewhere that the robot reported, and success of other rules. Draws a
/// map of all runs, and one of each failure with its reason. Same arguments: same rows and images
/// on any number of threads. Throws FileError, ContractError.
void reproduce_homing_in_world(const std::string& name, const Experiments& context);

/// Measures homing runs in the built-in scenes office, lab, hall, loop and garden, with one or two
/// seeds each: robot on flat ground, tilted by 3 degrees in a random direction per view, and
/// holonomic. Also measures image differences where runs end at home and where they end elsewhere;
/// `HomingPursuitOptions::arrived_difference` must be between the two.
void reproduce_homing_in_scenes(int starts, const Experiments& context);

}  // namespace panonav::lab
