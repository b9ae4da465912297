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

/// The camera of a homing robot and the number of components of its signatures.
struct HomingCamera {
  simulation::PanoramaRendering rendering{.rows = 40, .columns = 256, .rays_per_axis = 1};
  simulation::FrameOptions frame;  ///< height above the floor, tilt
  bool levelled = false;           ///< correct the tilt, as measured by an inertial sensor
  simulation::SensorOptions sensor;
  int components = 20;
};

/// A simulated place in which homing runs are made.
struct HomingPlace : simulation::SimulatedPlace {
  HomingCamera camera;
};

/// Renders the scene into a place for homing runs, with the camera at the height that the scene
/// states. Throws ContractError as `make_place`.
[[nodiscard]] HomingPlace make_homing_place(simulation::Scene scene, HomingCamera camera,
                                            Executor& executor);

/// Renders the robot's view at `pose`. The same pose and seed give the same bits.
[[nodiscard]] HomingView capture_homing_view(const HomingPlace& place, const Pose2& pose,
                                             std::uint64_t seed);
/// The same, preprocessed as the command does it for chains of snapshots and home areas.
[[nodiscard]] HomingView capture_chain_view(const HomingPlace& place, const Pose2& pose,
                                            std::uint64_t seed);

struct HomingRunOptions {
  /// Error of the wheels, and the drive: a differential robot turns before it drives, a holonomic
  /// one keeps its heading and drives in any direction.
  OdometryNoise motion;
  simulation::ObstacleRule obstacles = simulation::ObstacleRule::pass;
  simulation::ObstacleSensor sensor = simulation::ObstacleSensor::bumper;
  HomingPursuitOptions pursuit;
  FourierHomingOptions vector;
};

enum class HomingRunEnd {
  arrived,      ///< the robot reports that it is at home
  wrong_place,  ///< the robot reports that it stopped elsewhere
  blocked,      ///< an obstacle stopped it
  exhausted,    ///< the maximum number of steps was reached
};
/// Returns "arrived", "wrong place", "blocked" or "exhausted".
[[nodiscard]] std::string_view to_string(HomingRunEnd end);

/// The path and the result of one homing run.
struct HomingRun {
  Pose2 goal;
  std::vector<Pose2> path;          ///< true poses at all views, then at the end of the run
  std::vector<HomeVector> vectors;  ///< one home vector per view
  HomingRunEnd end = HomingRunEnd::exhausted;
  double end_distance_m = 0.0;    ///< from the goal
  double start_difference = 0.0;  ///< image difference of the first view from home
  double end_difference = 0.0;    ///< image difference of the last view from home
  bool met_obstacle = false;      ///< true if at least one step left the intended direction

  /// True if the robot reports an arrival within `radius_m` of the goal.
  [[nodiscard]] bool is_success(double radius_m) const noexcept;
};

/// Sends a robot from `start` to the place where the view `home` was taken. The robot knows only
/// this view, not its heading difference to it. `goal` is the true pose of that place, used for the
/// result. The same seed gives the same run. Throws OptionError, and ContractError if `start` is
/// not free. Cost: one rendered picture per step.
[[nodiscard]] HomingRun run_home(const HomingPlace& place, const HomingView& home,
                                 const Pose2& goal, const Pose2& start,
                                 const HomingRunOptions& options, std::uint64_t seed);

/// Goal and start of one homing run.
struct HomingTask {
  Pose2 goal;
  Pose2 start;
};

/// Draws `count` random goals in the free space, each with a start drawn uniformly from the free
/// positions within `radius_m`; all headings are random. Obstacles may be between start and goal.
/// Throws ContractError unless count >= 1 and radius_m > 0.
[[nodiscard]] std::vector<HomingTask> sample_homing_tasks(const HomingPlace& place, int count,
                                                          double radius_m, std::uint64_t seed);

/// Runs all homing tasks; run i uses the random stream (seed, i).
[[nodiscard]] std::vector<HomingRun> run_home(const HomingPlace& place,
                                              const std::vector<HomingTask>& tasks,
                                              const HomingRunOptions& options, std::uint64_t seed,
                                              Executor& executor);

}  // namespace panonav::lab
