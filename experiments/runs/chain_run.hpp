#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "experiments/runs/homing_run.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/homing/chain_follower.hpp"
#include "panonav/homing/chain_recorder.hpp"
#include "panonav/homing/snapshot_chain.hpp"
#include "panonav/motion/path.hpp"

namespace panonav {

/// Routes of at least `length_m` through the free places: shortest ways between random places, one
/// after the other, heading along the way, poses every `spacing_m`. Throws ContractError unless
/// both are above 0.
[[nodiscard]] std::vector<std::vector<Pose2>> random_routes(const FreeSpace& space, int count,
                                                            double length_m, double spacing_m,
                                                            std::uint64_t seed);

/// The chain that a robot records on its way along `route` (a view at each pose, which need not be
/// far apart), with odometry of this noise. The same seed gives the same chain. Throws OptionError,
/// and ContractError on an empty route.
[[nodiscard]] SnapshotChain record_chain(const HomingPlace& place, std::span<const Pose2> route,
                                         const OdometryNoise& odometry,
                                         const ChainRecorderOptions& options,
                                         const FourierHomingOptions& vector, std::uint64_t seed);

struct ChainRunOptions {
  ChainDirection direction = ChainDirection::forward;
  OdometryNoise motion;    ///< errors of what the wheels do, and how the robot moves
  OdometryNoise odometry;  ///< errors of what they tell
  ObstacleRule obstacles = ObstacleRule::pass;
  ChainFollowerOptions follower;
  HomingPursuitOptions pursuit;
  FourierHomingOptions vector;
  int most_steps = 1000;
};

/// What a robot did on its way along a chain.
struct ChainRun {
  std::vector<Pose2> path;  ///< true poses at the views, the start first
  ChainState state = ChainState::following;
  bool blocked = false;         ///< an obstacle ended the run
  double end_distance_m = 0.0;  ///< from the last place of the route
  /// From each pose of the path to the nearest place of the recorded route.
  std::vector<double> lateral_m;

  /// The robot says that it has finished, this near to the end of the route.
  [[nodiscard]] bool completes(double radius_m) const noexcept;
};

/// Sends a robot along the chain from `start`, whose heading does not count. `route` is the true
/// way of the recording, for the record. The same seed gives the same run. Throws as
/// `ChainFollower` and `SimulatedRobot`.
[[nodiscard]] ChainRun follow_chain(const HomingPlace& place, const SnapshotChain& chain,
                                    std::span<const Pose2> route, const Pose2& start,
                                    const ChainRunOptions& options, std::uint64_t seed);

/// Distance from a place to the nearest one of the polyline through the poses; infinity for none.
[[nodiscard]] double distance_from_route_m(Point2 place, std::span<const Pose2> route);

}  // namespace panonav
