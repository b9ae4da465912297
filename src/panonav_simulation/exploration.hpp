#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/motion/velocity.hpp"
#include "panonav/navigation/explorer.hpp"
#include "panonav_simulation/mission.hpp"
#include "panonav_simulation/obstacle_sense.hpp"

namespace panonav::simulation {

/// The robot of a simulated exploration.
struct ExplorationRobot {
  BaseOptions base;
  OdometryNoise motion;                               ///< its drive is replaced by that of `base`
  ObstacleSensor obstacles = ObstacleSensor::ranges;  ///< bumper or ranges
};

/// A simulated exploration.
struct ExplorationRun {
  ExplorationDecision::State end = ExplorationDecision::State::exploring;
  std::vector<Pose2> path;    ///< true poses at the observations
  std::vector<Pose2> views;   ///< true poses of the memorised views
  double explored_m = 0.0;    ///< driven until the explorer found the floor covered
  double travelled_m = 0.0;   ///< driven in all, with the way back to the start
  std::size_t contacts = 0;   ///< commands that an obstacle ended
  double end_distance_m = 0;  ///< true distance of the end from the start
};

/// Called at each observation, after the decision on it.
using ExplorationStep = std::function<void(const ExplorationDecision& decision, const Pose2& pose)>;

/// Explores a place from `start` with images of `sense_view`, noisy odometry and the robot's sensor
/// for obstacles. The explorer must be new. The same seed gives the same run. Throws ContractError
/// on the sensor `truth`. Cost: one image for each observation.
[[nodiscard]] ExplorationRun run_exploration(const MissionPlace& place, Explorer& explorer,
                                             const ExplorationRobot& robot, const Pose2& start,
                                             std::uint64_t seed, const ExplorationStep& step = {});

/// A boustrophedon path with true poses: the free positions of a grid in zigzag order, joined by
/// shortest paths.
struct Sweep {
  std::vector<Pose2> views;  ///< at the positions of the grid
  double length_m = 0.0;     ///< of the path from the first to the last
};
/// Plans the sweep whose views cover an open floor with catchment areas of `radius_m`: a square
/// grid of sqrt(2) radii.
[[nodiscard]] Sweep plan_sweep(const FreeSpace& space, double radius_m);

/// Measures the share of the free floor that views cover: of the free positions of a grid of
/// `grid_m`, those from which the robot homes to a view. This is a view within `radius_m` at the
/// end of a free straight line, whose home vector from an image at this position, with a random
/// heading, is right within 45 degrees. Cost: an image for each position and each view.
[[nodiscard]] double measure_coverage(const MissionPlace& place, std::span<const Pose2> views,
                                      double radius_m, double grid_m, std::uint64_t seed,
                                      Executor& executor);

}  // namespace panonav::simulation
