#pragma once

#include <cstdint>
#include <string>

#include "experiments/rows.hpp"
#include "experiments/runs/homing_run.hpp"
#include "panonav/core/executor.hpp"

namespace panonav {

/// The camera of chains of snapshots: few rows and frequencies, as a snapshot is to be small.
[[nodiscard]] HomingCamera chain_camera();

/// Chains of snapshots along `routes` random routes of 30 m through the place, each driven again
/// forward and back by a differential robot with errors of its wheels and of its odometry: rows
/// "s06.chain.NAME.*" of routes completed to within 20 cm, distance from the route, spacing and
/// bytes per metre. Throws ContractError.
void reproduce_snapshot_chains(const HomingPlace& place, const std::string& name,
                               std::uint64_t seed, int routes, Executor& executor,
                               Reproduction& reproduction);

/// The same in the built-in scenes office, hall, loop and corridor.
void reproduce_snapshot_chains(std::uint64_t seed, int routes, Executor& executor,
                               Reproduction& reproduction);

}  // namespace panonav
