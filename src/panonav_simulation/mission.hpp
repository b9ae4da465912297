#pragma once

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
#include "panonav_simulation/people.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::simulation {

/// A place to explore and to go about in.
struct MissionPlace : SimulatedPlace {
  PanoramaRendering rendering{.rows = 40, .columns = 256, .rays_per_axis = 1};
  SensorOptions sensor;
  int components = 15;
  /// Replaces the camera and preprocessing of `sense_view`; called from any number of threads.
  /// Empty: those of `sense_view`.
  std::function<FourierSignature(const Pose2& pose, std::uint64_t seed)> sight;
  /// The horizon scanline that a robot takes at a pose, to record and to follow routes; any number
  /// of threads may ask. Empty: it takes none.
  std::function<std::vector<float>(const Pose2& pose, std::uint64_t seed)> line;
};

/// Makes the place, see `make_place`.
[[nodiscard]] MissionPlace make_mission_place(Scene scene, Executor& executor,
                                              std::optional<Point2> inside = std::nullopt);

/// Returns lines through the simulated mirror camera (line_camera.hpp), as the experiments of [Y03]
/// have them: for `MissionPlace::line`. People who walk about are not in them.
[[nodiscard]] std::function<std::vector<float>(const Pose2& pose, std::uint64_t seed)>
make_line_sensor(const MissionPlace& place);

/// Computes the signature of the robot's view: the place's `sight`, or a panorama rendered
/// directly, with the people that are there, and preprocessed as the command's defaults have it.
/// The same pose, seed and people give the same bits.
[[nodiscard]] FourierSignature sense_view(const MissionPlace& place, const Pose2& pose,
                                          std::uint64_t seed, const People* people = nullptr);

/// Memory and graph of a place, with the true poses of its views.
struct RememberedPlace {
  VisualMemory memory;
  NavigationGraph graph;
  std::vector<Pose2> truth;          ///< by node of the graph; NaN where it is not known
  double spacing_m = 0.0;            ///< of the references
  std::vector<KnownRoute> routes{};  ///< recorded on the way
  /// Of an arrangement: by node of the graph, where it puts the views of its largest connected
  /// component; empty: it leaves the view out.
  std::vector<std::optional<Point2>> arranged{};
};

/// Records views on a grid, 20 cm or more from all things, each in a heading at random, arranged by
/// their similarity alone: no positions, no order, no motion [M04 section 3].
[[nodiscard]] RememberedPlace memorise_grid(const MissionPlace& place, double spacing_m,
                                            std::uint64_t seed, Executor& executor);

/// Records views along a drive, mapped by visual odometry and closure of loops, lengths by `wheels`
/// [F11 section 4]. The memory gets the poses of the map's largest component. Where the place has
/// lines the robot records a route, too, as far as that component goes without a gap: a line every
/// 10 cm at most [Y03 section 2.2], posed between the map's views, so that both lie in one frame.
[[nodiscard]] RememberedPlace memorise_drive(const MissionPlace& place,
                                             const std::vector<Pose2>& poses,
                                             const OdometryNoise& wheels, std::uint64_t seed,
                                             Executor& executor);

/// The robot of a mission: executes its commands with the errors of its drive, and stops where
/// something or somebody stands in its way. It feels what is near. Holds the true pose, and the
/// people around, for whom time passes as it drives.
class MissionRobot final : public RobotBase {
 public:
  /// `place` must outlive the robot. Throws OptionError; ContractError as `People`.
  MissionRobot(const MissionPlace& place, const BaseOptions& base, const OdometryNoise& motion,
               const Pose2& start, std::uint64_t seed, int people = 0);

  void command(const Velocity& velocity) override;

  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }
  [[nodiscard]] double travelled_m() const noexcept { return travelled_m_; }
  /// Finds the direction nearest to `direct_rad`, 15 degrees apart, in which half of the distance
  /// is free; while the direct one is blocked it keeps its side. Nullopt if none is free.
  [[nodiscard]] std::optional<double> find_free_direction(double direct_rad, double distance_m);
  /// Returns true if something stopped the robot since the last call.
  [[nodiscard]] bool take_contact() noexcept;
  /// Lets time pass.
  void wait(double seconds);
  /// Moves the robot unknown to its wheels.
  void carry_to(const Pose2& pose) noexcept { pose_ = pose; }
  /// Returns the motion by its wheels since the last call, robot_old_from_robot_new.
  [[nodiscard]] Pose2 take_odometry() noexcept;
  [[nodiscard]] const People& people() const noexcept { return people_; }

 private:
  [[nodiscard]] bool is_clear(Point2 from, Point2 to) const;

  const FreeSpace* space_;
  double robot_radius_m_;
  People people_;
  BaseOptions base_;
  OdometryNoise motion_;
  Pose2 pose_;
  Random random_;
  int side_ = 0;  // on which it goes past something: 1 left, -1 right
  bool obstacle_ = false;
  double travelled_m_ = 0.0;
  Pose2 odometry_;
};

struct MissionOptions {
  NavigatorOptions navigator;
  PlannerOptions planner;
  BaseOptions base;
  OdometryNoise motion;  ///< its drive is that of `base`
  int people = 0;        ///< who walk about
  /// Beside the navigator runs Monte-Carlo localisation over the references whose poses the memory
  /// knows. Where it is certain of the place and the navigator is not, the latter goes by it.
  bool monte_carlo = false;
};

/// A goal to reach, and the events on the way.
struct Mission {
  ViewId goal;
  Pose2 start;
  /// Pose to which the robot is carried after half of the path; empty: it is not kidnapped.
  std::optional<Pose2> kidnapped_to;
};

struct RandomMissionOptions {
  int count = 100;
  /// Largest distance of random starts and kidnapping targets from a reference; infinite: anywhere.
  double max_distance_m = std::numeric_limits<double>::infinity();
  bool kidnapped = false;  ///< somebody kidnaps the robot on its way
};

/// Draws missions from random free places, in any heading, to references at random that are at
/// least two spacings away.
[[nodiscard]] std::vector<Mission> sample_missions(const MissionPlace& place,
                                                   const RememberedPlace& remembered,
                                                   const RandomMissionOptions& options,
                                                   std::uint64_t seed);

struct MissionRun {
  NavigationDecision::State end = NavigationDecision::State::moving;
  std::vector<Pose2> path;  ///< true poses at the steps, and the last one
  std::vector<NavigationDecision> decisions;
  std::optional<std::size_t> kidnapped_at;  ///< the step after which the robot was kidnapped
  double end_distance_m = 0.0;              ///< from where the goal's view was taken; NaN: unknown
  double travelled_m = 0.0;
  /// Shortest way through free places, in components when kidnapped or sent to another goal; NaN:
  /// unknown.
  double shortest_m = 0.0;

  /// True if the robot reports an arrival within `radius_m` of the goal.
  [[nodiscard]] bool arrives(double radius_m) const noexcept {
    return end == NavigationDecision::State::arrived && end_distance_m <= radius_m;
  }
};

/// Describes the missions that do not end as `expected`. `ends` counts all missions, `wrongly`
/// those that report an arrival but are farther off.
[[nodiscard]] std::string explain_other_ends(
    const std::map<NavigationDecision::State, std::size_t>& ends, std::size_t wrongly,
    NavigationDecision::State expected = NavigationDecision::State::arrived);

/// Called after each step, with the true pose.
using StepReport = std::function<void(const NavigationDecision& decision, const Pose2& pose)>;

/// Called after each step of a continuing mission. Returns another goal, which the navigator has
/// already; nullopt: none.
using GoalSource = std::function<std::optional<ViewId>()>;

/// Runs a mission over a remembered place; `place` may differ from the place that was remembered.
/// Where it is not known where the goal's view was taken, nobody carries the robot away. The robot
/// takes lines when the navigator has routes. The same seed gives the same run. Cost: a picture a
/// look.
[[nodiscard]] MissionRun run_mission(const MissionPlace& place, const RememberedPlace& remembered,
                                     Navigator& navigator, const Mission& mission,
                                     const MissionOptions& options, std::uint64_t seed,
                                     const StepReport& report_step = {},
                                     const GoalSource& other_goal = {});

/// Runs to one goal after the other: each run begins where the one before ended, with the place
/// known that the robot then believes in. A goal that was not reached does not end the tour.
/// Otherwise as `run_mission`.
[[nodiscard]] std::vector<MissionRun> run_tour(const MissionPlace& place,
                                               const RememberedPlace& remembered,
                                               Navigator& navigator, const Pose2& start,
                                               std::span<const ViewId> goals,
                                               const MissionOptions& options, std::uint64_t seed);

/// Runs all missions, each with a navigator of its own and the remembered routes; run i has the
/// random stream (seed, i).
[[nodiscard]] std::vector<MissionRun> run_missions(const MissionPlace& place,
                                                   const RememberedPlace& remembered,
                                                   const std::vector<Mission>& missions,
                                                   const MissionOptions& options,
                                                   std::uint64_t seed, Executor& executor);

}  // namespace panonav::simulation
