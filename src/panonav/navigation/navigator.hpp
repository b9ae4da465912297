#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/homing/homing_pursuit.hpp"
#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/area_planner.hpp"
#include "panonav/navigation/known_route.hpp"

namespace panonav {

/// Options of a navigator, among them when a robot is considered blocked or lost.
struct NavigatorOptions {
  /// Longest step between two observations; should be about half the references' spacing.
  double step_m = 0.25;
  int near_links = 2;  ///< the next place is searched within this number of edges of the last one
  /// Number of components compared in open areas: 3 or more, or 0 for all. All are compared near
  /// narrow gates and the goal, and when the place is doubtful.
  int coarse_components = 6;
  /// Number of views of the next area that each observation prefetches, so that entering an area
  /// takes little time; 0: none.
  int views_ahead = 20;
  /// Homing to the goal. The navigator replaces its arrival thresholds (difference and length) by
  /// values learnt from the references around the goal, and limits its longest step to `step_m`.
  HomingPursuitOptions homing;
  /// Number of observations that must agree before another place or a blocked edge is accepted.
  int min_agreeing_steps = 3;
  /// Number of observations without a known or probable place after which the robot is lost.
  int lost_patience = 12;
  /// Number of observations without progress towards the goal (more on a long edge) after which the
  /// most tried edge is blocked. After half this number the robot tries other directions.
  int edge_patience = 8;
  double min_leg_m = 0.75;   ///< shortest leg along a recorded route: three steps
  int attempts = 3;          ///< number of attempts: blocked edges or homing are tried again
  int max_run_steps = 5000;  ///< after which a run ends as blocked
};
void visit_options(NavigatorOptions& options, OptionVisitor& visitor);

/// Report of a robot about its last step, in addition to its view.
struct RobotReport {
  bool obstacle = false;  ///< an obstacle stopped the robot during the last step
  /// Reference nearest to the position estimated by a `MonteCarloLocaliser` or `Localiser`; nullopt
  /// if that estimate is not certain. Replaces the last place for memories in which single views
  /// mislead because places look similar. The navigator searches around it, so it need not be
  /// exact.
  std::optional<ViewId> estimate;
  /// The horizon scanline of this observation (route/horizon_scanline.hpp), for legs along routes;
  /// empty: none.
  std::span<const float> line;
  /// Motion since the last observation by odometry, in the robot frame of that observation; for
  /// legs along routes.
  Pose2 moved;
};

/// One decision with its reasons: the log entry of an observation.
struct NavigationDecision {
  /// Progress of a run to a goal.
  enum class State {
    moving,       ///< the run continues
    arrived,      ///< the views show the goal
    blocked,      ///< the robot cannot pass, although a path is planned
    lost,         ///< the view is not in the memory, or not where the robot should be
    unreachable,  ///< no path leads to the goal, or all of them turned out to be blocked
  };
  /// Special events of a decision, beyond simply the next step.
  enum class Event {
    relocalised,    ///< the place was searched in the whole memory
    kidnapped,      ///< another place than the expected one is accepted
    entered_area,   ///< another area was loaded
    unknown_place,  ///< the reference does not match the view
    obstructed,     ///< the robot could not make its last step
    closed,         ///< edges were blocked and the path was planned again
    reopened,       ///< blocked edges are tried again
    homing,         ///< homing to the goal begins
    homing_failed,  ///< homing ended at another place
    crossing,       ///< homing to a view of another component of the arrangement begins
    route,          ///< a leg along a recorded route begins
    route_left,     ///< the leg ended before its end
  };

  int step = 0;                   ///< counts from 1
  State state = State::moving;    ///< after this observation
  double direction_rad = 0.0;     ///< direction of motion in the current robot frame
  double advance_m = 0.0;         ///< length of the step; 0 unless moving
  bool homing = false;            ///< the robot homes to the goal by the home vector
  bool on_route = false;          ///< the robot follows a recorded route by the horizon scanline
  std::optional<ViewId> nearest;  ///< the place
  /// Probability that the robot is at `nearest`: `place_probability` with the difference to
  /// `nearest` instead of that to the best match. 0 after the end of the run.
  double probability = 0.0;
  std::optional<ViewId> next;  ///< next reference; on a route leg the one at its end
  std::size_t area = 0;        ///< loaded area
  /// `image_difference` between the view and `nearest`; during homing, between the view and the
  /// goal.
  double difference = 0.0;
  double path_length = 0.0;  ///< remaining path length along the edges, in the graph's unit
  int components = 0;        ///< number of components compared with references
  /// Bytes of the loaded area's signatures and index read by this observation, without those read
  /// for `probability`.
  std::uint64_t bytes_read = 0;
  std::vector<Event> events;  ///< in the order in which they happened
};
/// Returns "moving", "arrived", "blocked", "lost" or "unreachable".
[[nodiscard]] std::string_view to_string(NavigationDecision::State state);
/// Returns the event in lower case with underscores, as in logs and JSON: "relocalised",
/// "entered_area", ...
[[nodiscard]] std::string_view to_string(NavigationDecision::Event event);
/// Returns one line for a log.
[[nodiscard]] std::string describe(const NavigationDecision& decision);

/// Leads a robot to a place of the memory by views alone [M04 section 3.5]: observe, find the
/// nearest reference, move in its direction, observe again; near the goal, home to it. Where the
/// path follows a recorded route and the robot reports its horizon scanlines, it repeats the route
/// instead [Y03].
///
/// Holds the state of a run and the views of one area, near a border of two.
/// `compute_command_towards` (motion/velocity.hpp) computes the robot's commands. Same calls, same
/// bits. Cost of an observation without a change of area: a search among the loaded views and at
/// most three home vectors; near a route also a path plan or a scanline fit.
class Navigator {
 public:
  /// The source must hold all views of the planner's graph and outlive *this. Throws OptionError,
  /// ContractError when the graph is empty.
  Navigator(const ViewSource& source, AreaPlanner planner, const NavigatorOptions& options = {});
  ~Navigator();
  /// The source of a move may only be destroyed or assigned to.
  Navigator(Navigator&& other) noexcept;
  Navigator& operator=(Navigator&& other) noexcept;

  /// Begins a run to this goal. Keeps the robot's place and unblocks all edges. Throws
  /// ContractError if the view is not in the graph.
  void set_goal(ViewId goal);

  /// Sets recorded routes to follow, which must outlive *this. Without any, `RobotReport::line` is
  /// ignored.
  void set_routes(std::span<const KnownRoute> routes);
  [[nodiscard]] std::span<const KnownRoute> routes() const noexcept;  ///< Same as were set.

  /// Forgets the robot's place, so that the next observation is searched in the whole memory.
  void forget_place();

  /// Decides on the next motion after an observation. After the run has ended, every decision is to
  /// stand still. Throws ContractError without a goal, and on a signature or line of another shape
  /// than the memory's and the routes'.
  [[nodiscard]] NavigationDecision observe(const FourierSignature& view,
                                           const RobotReport& report = {});

  /// The planner with its graph, its areas and the edges blocked now.
  [[nodiscard]] const AreaPlanner& planner() const noexcept;
  /// Returns the number of loaded views: those in and around the current area, and prefetched
  /// views of the next area.
  [[nodiscard]] std::size_t loaded_view_count() const noexcept;

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

}  // namespace panonav
