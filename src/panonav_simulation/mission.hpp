#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/core/options.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/motion/velocity.hpp"
#include "panonav/navigation/known_route.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/navigation/navigator.hpp"
#include "panonav_simulation/obstacle_sense.hpp"
#include "panonav_simulation/people.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::simulation {

/// A simulated place that is explored and in which missions are run.
struct MissionPlace : SimulatedPlace {
  PanoramaRendering rendering{.rows = 40, .columns = 256, .rays_per_axis = 1};
  SensorOptions sensor;
  int components = 15;
  /// Replaces camera and preprocessing of `sense_view`; may be called from any number of threads.
  /// If empty, `sense_view` uses its own.
  std::function<FourierSignature(const Pose2& pose, std::uint64_t seed)> view_sensor;
  /// Returns the horizon scanline at a pose, for recording and following routes; may be called from
  /// any number of threads. If empty, no lines are taken.
  std::function<std::vector<float>(const Pose2& pose, std::uint64_t seed)> line;
};

/// Makes a place for missions; parameters and errors as of `make_place`.
[[nodiscard]] MissionPlace make_mission_place(Scene scene, Executor& executor,
                                              std::optional<Point2> inside = std::nullopt);

/// Returns a `MissionPlace::line` that takes lines with the simulated mirror camera
/// (line_camera.hpp), as in the experiments of [Y03]. Walking people are not visible in them.
[[nodiscard]] std::function<std::vector<float>(const Pose2& pose, std::uint64_t seed)>
make_line_sensor(const MissionPlace& place);

/// Computes the signature of the robot's view: by the place's `view_sensor` if set, else from a
/// rendered panorama with `people`, preprocessed with the defaults of the command line program. The
/// same pose, seed and people give the same bits.
[[nodiscard]] FourierSignature sense_view(const MissionPlace& place, const Pose2& pose,
                                          std::uint64_t seed, const People* people = nullptr);

/// Memory and navigation graph of a place, with the true poses of its views.
struct RememberedPlace {
  VisualMemory memory;
  NavigationGraph graph;
  std::vector<Pose2> truth;          ///< by node of the graph; NaN if unknown
  double spacing_m = 0.0;            ///< distance between neighbouring references
  std::vector<KnownRoute> routes{};  ///< recorded during the drive
  /// Positions in an arrangement, by node of the graph; nullopt for views outside its largest
  /// connected component.
  std::vector<std::optional<Point2>> arranged{};
};

/// Records views on a grid, 20 cm or more from all obstacles, each with a random heading, and
/// arranges them by their similarity alone: no positions, no order, no motion [M04 section 3].
[[nodiscard]] RememberedPlace memorise_grid(const MissionPlace& place, double spacing_m,
                                            std::uint64_t seed, Executor& executor);

/// Records views along a drive and maps them by visual odometry and loop closure, with lengths from
/// `wheels` [F11 section 4]. The memory gets the poses of the map's largest component. If the place
/// has lines, the robot also records a route along this component up to its first gap: a line at
/// least every 10 cm [Y03 section 2.2], with poses interpolated between those of the map's
/// views, so that both are in the same frame.
[[nodiscard]] RememberedPlace memorise_drive(const MissionPlace& place,
                                             const std::vector<Pose2>& poses,
                                             const OdometryNoise& wheels, std::uint64_t seed,
                                             Executor& executor);

/// The simulated robot of a mission: executes commands with the errors of its drive, stops in
/// contact with obstacles and people, and senses them by its `ObstacleSensor`. Holds the true pose,
/// and the people around, who walk while it drives.
class MissionRobot final : public RobotBase {
 public:
  /// `place` must outlive the robot. Throws OptionError, and ContractError as `People` and if
  /// the robot sees with a camera that `place` does not have.
  MissionRobot(const MissionPlace& place, const BaseOptions& base, const OdometryNoise& motion,
               const Pose2& start, std::uint64_t seed, int people = 0,
               ObstacleSensor obstacles = ObstacleSensor::bumper);

  void command(const Velocity& velocity) override;

  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }
  [[nodiscard]] double travelled_m() const noexcept { return travelled_m_; }
  /// Number of commands that ended in contact.
  [[nodiscard]] std::size_t contacts() const noexcept { return contacts_; }
  /// Finds the direction nearest to `direct_rad`, in steps of 15 degrees up to 90 degrees, in which
  /// half of the distance is free as far as the sensor knows. While the direct one is blocked, it
  /// prefers the side chosen before. If none is free, directions that the robot only measured to be
  /// blocked count as free; nullopt if there is none.
  [[nodiscard]] std::optional<double> find_free_direction(double direct_rad, double distance_m);
  /// Returns true if the robot was stopped by contact since the last call.
  [[nodiscard]] bool take_contact() noexcept;
  /// Returns the direction of the last contact in the robot frame, as one of the bumper's eight.
  [[nodiscard]] double contact_rad() const noexcept { return contact_rad_; }
  /// Measures the ring of ranges (`measure_ranges`).
  [[nodiscard]] std::array<double, sensor_directions> read_ranges();
  /// Drives back a little, against the command that led to the last contact.
  void back_off();
  [[nodiscard]] ObstacleSensor obstacle_sensor() const noexcept { return sensor_; }
  /// Lets people walk for some seconds while the robot stands.
  void wait(double seconds);
  /// Moves the robot to a pose without its odometry noticing (kidnapping).
  void teleport_to(const Pose2& pose) noexcept { pose_ = pose; }
  /// Returns the motion by odometry since the last call, robot_old_from_robot_new, and resets it.
  [[nodiscard]] Pose2 take_odometry() noexcept;
  /// Returns the motion by odometry since `take_odometry`, robot_old_from_robot_new.
  [[nodiscard]] const Pose2& odometry() const noexcept { return odometry_; }
  [[nodiscard]] const People& people() const noexcept { return people_; }

 private:
  [[nodiscard]] bool has_clear_path(Point2 from, Point2 to) const;

  const FreeSpace* space_;
  double robot_radius_m_;
  People people_;
  BaseOptions base_;
  OdometryNoise motion_;
  Pose2 pose_;
  Random random_;
  ObstacleSensor sensor_;
  Random noise_of_ranges_;
  std::optional<FloorSensor> floor_;
  ObstacleMemory known_;
  std::size_t contacts_ = 0;
  Velocity contact_velocity_;  // the command of the last contact
  double contact_rad_ = 0.0;   // its direction
  int detour_side_ = 0;        // side of the last detour: 1 left, -1 right, 0 none
  bool obstacle_ = false;
  double travelled_m_ = 0.0;
  Pose2 odometry_;
};

/// Drives `distance_m` towards `direct_rad`, in the robot frame, until time runs out or contact
/// ends the step, which returns true.
bool drive_step(MissionRobot& robot, const BaseOptions& base, double direct_rad, double distance_m);

struct MissionOptions {
  NavigatorOptions navigator;
  PlannerOptions planner;
  BaseOptions base;
  OdometryNoise motion;  ///< its drive is replaced by that of `base`
  int people = 0;        ///< number of people who walk about
  ObstacleSensor obstacles = ObstacleSensor::bumper;
  /// Runs Monte-Carlo localisation over the references with known poses, in parallel to the
  /// navigator. When it is localised and the navigator is in doubt, the navigator uses its
  /// estimate.
  bool monte_carlo = false;
};

/// A goal to reach from a start, optionally with a kidnapping on the way.
struct Mission {
  ViewId goal;
  Pose2 start;
  /// Pose to which the robot is carried after half of the path; nullopt: not kidnapped.
  std::optional<Pose2> kidnapped_to;
};

struct RandomMissionOptions {
  int count = 100;
  /// Largest distance of random starts and kidnapping targets from a reference; infinite: no limit.
  double max_distance_m = std::numeric_limits<double>::infinity();
  bool kidnapped = false;  ///< the robot is kidnapped on its way
};

/// Draws missions from random free poses to random references at least two spacings away.
[[nodiscard]] std::vector<Mission> sample_missions(const MissionPlace& place,
                                                   const RememberedPlace& remembered,
                                                   const RandomMissionOptions& options,
                                                   std::uint64_t seed);

struct MissionRun {
  NavigationDecision::State end = NavigationDecision::State::moving;
  std::vector<Pose2> path;  ///< true poses at the steps, then at the end
  std::vector<NavigationDecision> decisions;
  std::optional<std::size_t> kidnapped_at;  ///< index of the step after which it was kidnapped
  double end_distance_m = 0.0;              ///< from the true pose of the goal's view; NaN: unknown
  double travelled_m = 0.0;
  std::size_t contacts = 0;  ///< number of commands that an obstacle or a person ended
  /// Length of the shortest free path; the sum of its parts after a kidnapping or a change of the
  /// goal; NaN: unknown.
  double shortest_m = 0.0;

  /// True if the robot reports an arrival within `radius_m` of the goal.
  [[nodiscard]] bool has_arrived(double radius_m) const noexcept {
    return end == NavigationDecision::State::arrived && end_distance_m <= radius_m;
  }
};

/// Describes in words the missions that did not end as `expected`. `ends` counts all missions,
/// `false_arrivals` those that reported an arrival farther off.
[[nodiscard]] std::string explain_other_ends(
    const std::map<NavigationDecision::State, std::size_t>& ends, std::size_t false_arrivals,
    NavigationDecision::State expected = NavigationDecision::State::arrived);

/// Called after each step, with the decision and the true pose.
using StepReport = std::function<void(const NavigationDecision& decision, const Pose2& pose)>;

/// Called after each step of a continuing mission. Returns the new goal if it changed; the caller
/// has set it in the navigator already. nullopt: no change.
using GoalSource = std::function<std::optional<ViewId>()>;

/// Runs a mission over a remembered place; `place` may differ from the place that was memorised.
/// The robot is not kidnapped if the true position of the goal's view is unknown. The robot takes
/// lines if the navigator has routes. The same seed gives the same run. Cost: one rendered picture
/// per step.
[[nodiscard]] MissionRun run_mission(const MissionPlace& place, const RememberedPlace& remembered,
                                     Navigator& navigator, const Mission& mission,
                                     const MissionOptions& options, std::uint64_t seed,
                                     const StepReport& report_step = {},
                                     const GoalSource& other_goal = {});

/// Runs to one goal after the other: each run begins where the previous one ended, and the
/// navigator keeps its estimate of the place, except after it was lost. A goal that was not reached
/// does not end the tour. Otherwise as `run_mission`.
[[nodiscard]] std::vector<MissionRun> run_tour(const MissionPlace& place,
                                               const RememberedPlace& remembered,
                                               Navigator& navigator, const Pose2& start,
                                               std::span<const ViewId> goals,
                                               const MissionOptions& options, std::uint64_t seed);

/// Runs all missions, each with its own navigator and the remembered routes; run i uses the random
/// stream (seed, i).
[[nodiscard]] std::vector<MissionRun> run_missions(const MissionPlace& place,
                                                   const RememberedPlace& remembered,
                                                   const std::vector<Mission>& missions,
                                                   const MissionOptions& options,
                                                   std::uint64_t seed, Executor& executor);

}  // namespace panonav::simulation
