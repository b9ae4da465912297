#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/homing/homing_pursuit.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav_simulation/place_recording.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/simulated_robot.hpp"

namespace panonav::lab {

/// The camera of a homing robot and the components of its signatures.
struct HomingCamera {
  simulation::PanoramaRendering rendering{.rows = 40, .columns = 256, .rays_per_axis = 1};
  simulation::FrameOptions frame;  ///< height above the floor, tilt
  bool levelled = false;  ///< an inertial sensor measures the tilt, and views are turned upright
  simulation::SensorOptions sensor;
  int components = 20;
};

/// A place in which robots are sent home.
struct HomingPlace : simulation::SimulatedPlace {
  HomingCamera camera;
};

/// Makes the place of a scene, with the camera at the height of the scene. Throws ContractError as
/// `make_place`.
[[nodiscard]] HomingPlace make_homing_place(simulation::Scene scene, HomingCamera camera,
                                            Executor& executor);

/// Renders the view of a robot there. The same pose and seed give the same bits.
[[nodiscard]] HomingView take_homing_view(const HomingPlace& place, const Pose2& pose,
                                          std::uint64_t seed);

struct HomingRunOptions {
  /// Error of the wheels. A differential robot turns, then drives; a holonomic one never turns, and
  /// drives sideways.
  OdometryNoise motion;
  simulation::ObstacleRule obstacles = simulation::ObstacleRule::pass;
  HomingPursuitOptions pursuit;
  FourierHomingOptions vector;
};

enum class HomingRunEnd {
  arrived,      ///< the robot says that it is at home
  wrong_place,  ///< the robot says that it stopped somewhere else
  blocked,      ///< an obstacle stopped it
  exhausted,    ///< the maximum number of steps was reached
};
/// Returns "arrived", "wrong place", "blocked" or "exhausted".
[[nodiscard]] std::string_view to_string(HomingRunEnd end);

/// A run home.
struct HomingRun {
  Pose2 goal;
  std::vector<Pose2> path;          ///< true poses at the views, the start first; and the last one
  std::vector<HomeVector> vectors;  ///< at these poses
  HomingRunEnd end = HomingRunEnd::exhausted;
  double end_distance_m = 0.0;    ///< from the goal
  double start_difference = 0.0;  ///< image difference of the first view from home
  double end_difference = 0.0;    ///< image difference of the last view from home
  bool met_obstacle = false;      ///< at least one step was not in the intended direction

  /// True if the robot reports an arrival within `radius_m` of the goal.
  [[nodiscard]] bool is_success(double radius_m) const noexcept;
};

/// Sends a robot from `start` to the place where `home` was seen, of which it knows that view alone
/// and not how it is turned against it. `goal` is for the record. The same seed gives the same run.
/// Throws OptionError, and ContractError when `start` is not free. Cost: one picture per step.
[[nodiscard]] HomingRun run_home(const HomingPlace& place, const HomingView& home,
                                 const Pose2& goal, const Pose2& start,
                                 const HomingRunOptions& options, std::uint64_t seed);

/// Start and goal of a run.
struct HomingTask {
  Pose2 goal;
  Pose2 start;
};

/// Draws random goals in the free space, each with a start uniform over the free places within
/// `radius_m`, all headings random. Places as the scene has them: walls and things may stand in
/// between. Throws ContractError unless count >= 1 and radius_m > 0.
[[nodiscard]] std::vector<HomingTask> sample_homing_tasks(const HomingPlace& place, int count,
                                                          double radius_m, std::uint64_t seed);

/// Runs all tasks; run i has the stream (seed, i).
[[nodiscard]] std::vector<HomingRun> run_home(const HomingPlace& place,
                                              const std::vector<HomingTask>& tasks,
                                              const HomingRunOptions& options, std::uint64_t seed,
                                              Executor& executor);

}  // namespace panonav::lab
