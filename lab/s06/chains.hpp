#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "lab/experiments.hpp"
#include "lab/runs/homing_run.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/random.hpp"
#include "panonav/route/chain_follower.hpp"
#include "panonav/route/chain_recorder.hpp"
#include "panonav_simulation/obstacle_sense.hpp"

namespace panonav::lab {

/// Returns the camera for chains of snapshots, with few rows and frequencies to keep snapshots
/// small.
[[nodiscard]] HomingCamera chain_camera();

/// Plans routes of at least `length_m`: consecutive shortest paths between random free positions,
/// headings along the path, poses every `spacing_m`. Throws ContractError unless both lengths are
/// above 0.
[[nodiscard]] std::vector<std::vector<Pose2>> plan_random_routes(const simulation::FreeSpace& space,
                                                                 int count, double length_m,
                                                                 double spacing_m,
                                                                 std::uint64_t seed);

/// The odometry of one drive, with constant errors within limits: of the scale of distances, of the
/// heading for each metre, and a drift in a constant direction that it does not measure.
class DriftingOdometry {
 public:
  DriftingOdometry(const ChainOdometry& limits, Random& random);
  /// Returns the measured motion between two true poses.
  [[nodiscard]] Pose2 measure(const Pose2& from, const Pose2& to) const;

 private:
  double scale_ = 1.0;
  double turn_rad_per_m_ = 0.0;
  Point2 wind_m_per_m_;
};

/// Records a chain along `route`, with a view at each pose (poses may be close together) and
/// odometry errors within the limits of `ChainOdometry`. The same seed gives the same chain.
[[nodiscard]] SnapshotChain record_chain(const HomingPlace& place, std::span<const Pose2> route,
                                         const ChainSpacing& spacing, std::uint64_t seed);

/// The path and the result of one run along a chain.
struct ChainRun {
  std::vector<Pose2> path;  ///< true poses at the views, the start first
  ChainState state = ChainState::travelling;
  double end_distance_m = 0.0;  ///< from the end of the route
  /// Distances from each pose of the path to the nearest point of the recorded route.
  std::vector<double> lateral_m;

  /// True if the robot reports that it has arrived, and is within `radius_m` of the end of the
  /// route.
  [[nodiscard]] bool has_completed(double radius_m) const noexcept;
  /// True if the robot reports that it has arrived, but is not within `radius_m` of the end.
  [[nodiscard]] bool has_arrived_elsewhere(double radius_m) const noexcept;
};

/// Drives a differential robot along the chain, from the first or the last pose of `route` (the
/// true path of the recording), with a random heading, wheel and odometry errors; it drives around
/// obstacles by its sensor. The run ends when the follower reports an end, when no direction is
/// free, or after 1000 steps and 5 for each metre of the route. The same seed gives the same run.
/// Throws ContractError on an empty route or chain.
[[nodiscard]] ChainRun follow_chain(
    const HomingPlace& place, const SnapshotChain& chain, std::span<const Pose2> route,
    ChainDirection direction, std::uint64_t seed,
    simulation::ObstacleSensor sensor = simulation::ObstacleSensor::bumper);

/// Measures chains of snapshots along `routes` random routes of 60 m through the place, each
/// repeated forward and back. The rows "s06.chain.NAME.*" are routes completed to within 50 cm,
/// arrivals elsewhere, offset at the end, distance from the route, spacing and bytes per 100 m.
/// Throws ContractError.
void reproduce_snapshot_chains(const HomingPlace& place, const std::string& name,
                               std::uint64_t seed, int routes, Executor& executor,
                               Reproduction& reproduction);

/// Measures snapshot chains in the built-in scenes office, hall, loop and corridor.
void reproduce_snapshot_chains(int routes, const Experiments& context);

}  // namespace panonav::lab
