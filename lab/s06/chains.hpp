#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "lab/experiments.hpp"
#include "lab/runs/homing_run.hpp"
#include "lab/s06/snapshot_chain.hpp"
#include "panonav/core/executor.hpp"

namespace panonav::lab {

/// Returns the camera of chains of snapshots: few rows and frequencies, as a snapshot is to be
/// small.
[[nodiscard]] HomingCamera chain_camera();

/// Plans routes of at least `length_m` through the free places: shortest paths between random
/// places, one after the other, heading along the path, poses every `spacing_m`. Throws
/// ContractError unless both are above 0.
[[nodiscard]] std::vector<std::vector<Pose2>> plan_random_routes(const simulation::FreeSpace& space,
                                                                 int count, double length_m,
                                                                 double spacing_m,
                                                                 std::uint64_t seed);

/// Records a chain along `route` (a view at each pose, which need not be
/// far apart), with errors of its odometry. The same seed gives the same chain.
[[nodiscard]] SnapshotChain record_chain(const HomingPlace& place, std::span<const Pose2> route,
                                         std::uint64_t seed);

/// A run along a chain.
struct ChainRun {
  std::vector<Pose2> path;  ///< true poses at the views, the start first
  ChainState state = ChainState::following;
  double end_distance_m = 0.0;  ///< from the last place of the route
  /// From each pose of the path to the nearest place of the recorded route.
  std::vector<double> lateral_m;

  /// True if the robot reports that it has finished within `radius_m` of the end of the route.
  [[nodiscard]] bool has_completed(double radius_m) const noexcept;
};

/// Drives a differential robot along the chain from the first or the last pose of `route`, the true
/// way of the recording, with errors of its wheels and of its odometry; it goes past obstacles. The
/// run ends where the follower reports it, where no direction is free, and after 1000 steps. The
/// same seed gives the same run. Throws ContractError on an empty route or chain.
[[nodiscard]] ChainRun follow_chain(const HomingPlace& place, const SnapshotChain& chain,
                                    std::span<const Pose2> route, ChainDirection direction,
                                    std::uint64_t seed);

/// Measures chains of snapshots along `routes` random routes of 30 m through the place, each driven
/// again forward and back: rows "s06.chain.NAME.*" of routes completed to within 20 cm, distance
/// from the route, spacing and bytes per metre. Throws ContractError.
void reproduce_snapshot_chains(const HomingPlace& place, const std::string& name,
                               std::uint64_t seed, int routes, Executor& executor,
                               Reproduction& reproduction);

/// Measures the same in the built-in scenes office, hall, loop and corridor.
void reproduce_snapshot_chains(int routes, const Experiments& context);

}  // namespace panonav::lab
