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

/// Options of a navigator, and when a robot counts as blocked or lost.
struct NavigatorOptions {
  /// Longest step between two observations; about half the references' spacing.
  double step_m = 0.25;
  int near_links = 2;  ///< the next place is searched within this number of edges of the last one
  /// Components compared in the open: 3 or more, or 0 for all. All are compared around narrow gates
  /// and the goal, and where a place is doubtful.
  int coarse_components = 6;
  /// Views of the next area that an observation prefetches, so that none waits for all; 0: none.
  int views_ahead = 20;
  /// Homing to the goal. Its difference and length of arrival come from the references around the
  /// goal, its longest step is `step_m` at most.
  HomingPursuitOptions homing;
  /// Observations that must agree before another place or a blocked edge is believed.
  int min_agreeing_steps = 3;
  /// Observations without a known or probable place after which the robot is lost.
  int lost_patience = 12;
  /// Observations without coming nearer to the goal, more along a long edge, after which the edge
  /// tried most counts as blocked; from half of them on the robot searches around.
  int edge_patience = 8;
  double min_leg_m = 0.75;   ///< shortest leg along a recorded route: three steps
  int attempts = 3;          ///< times that blocked edges, or homing, are tried
  int max_run_steps = 5000;  ///< after which a run ends as blocked
};
void visit_options(NavigatorOptions& options, OptionVisitor& visitor);

/// Report of a robot besides its view.
struct RobotReport {
  bool obstacle = false;  ///< something stopped the robot before the last step was done
  /// The reference nearest to the position of another estimate, as of `MonteCarloLocaliser` or
  /// `Localiser`. It replaces the last place, and the navigator searches around it, so it need not
  /// be exact: for places that look similar, where single views mislead. nullopt where the estimate
  /// is not certain: the views decide then.
  std::optional<ViewId> estimate;
  /// The horizon scanline of this observation (route/horizon_scanline.hpp), for legs along routes;
  /// empty: none.
  std::span<const float> line;
  /// Motion since the last observation by odometry, in the frame that the robot had then; for legs
  /// along routes.
  Pose2 moved;
};

/// One decision with its reasons: the log entry of an observation.
struct NavigationDecision {
  /// Progress of a run to a goal.
  enum class State {
    moving,       ///< the run continues
    arrived,      ///< the views show the goal
    blocked,      ///< the robot cannot pass although the memory has a path
    lost,         ///< the view is nowhere in the memory, or not where the robot should be
    unreachable,  ///< no path leads to the goal, or all of them turned out to be blocked
  };
  /// Why a decision is not simply the next step.
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
    route,          ///< a leg along a recorded route begins
    route_left,     ///< the leg ended before its end
  };

  int step = 0;                   ///< counts from 1
  State state = State::moving;    ///< after this observation
  double direction_rad = 0.0;     ///< of motion, in the current robot frame
  double advance_m = 0.0;         ///< length of the step; 0 unless moving
  bool homing = false;            ///< the robot homes to the goal by the home vector
  bool on_route = false;          ///< a leg along a recorded route, by the horizon scanline
  std::optional<ViewId> nearest;  ///< the place
  /// Probability that the robot is there: `place_probability` of the view, with the difference of
  /// `nearest` instead of the best match's. 0 once the run has ended.
  double probability = 0.0;
  std::optional<ViewId> next;  ///< the reference ahead; of a leg that at its end
  std::size_t area = 0;        ///< that is loaded
  /// `image_difference` of the view from `nearest`; while homing from the goal.
  double difference = 0.0;
  double path_length = 0.0;  ///< that is left along the edges, in the graph's unit
  int components = 0;        ///< by which references were compared
  /// Of the loaded area's signatures and index, by this observation, without `probability`.
  std::uint64_t bytes_read = 0;
  std::vector<Event> events;  ///< in the order in which they happened
};
/// "moving", "arrived", "blocked", "lost", "unreachable".
[[nodiscard]] std::string_view name_of(NavigationDecision::State state);
/// Returns the event in lower case with underscores, as in logs and JSON: "relocalised",
/// "entered_area", ...
[[nodiscard]] std::string_view name_of(NavigationDecision::Event event);
/// Returns one line for a log.
[[nodiscard]] std::string describe(const NavigationDecision& decision);

/// Leads a robot to a place of the memory by views alone [M04 section 3.5]: observe, find the
/// nearest reference, take its direction, move, observe again; near the goal by homing. Where the
/// path follows a recorded route and the robot reports its horizon scanlines, it repeats the route
/// instead [Y03].
///
/// Holds the state of a run and the views of one area, two at a border. `compute_command_towards`
/// (motion/velocity.hpp) makes the robot's commands. Same calls, same bits. Cost of an observation
/// without a change of area: the search among the loaded views and three home vectors at most; near
/// a route also a plan or a fit.
class Navigator {
 public:
  /// The source must hold all views of the planner's graph and outlive *this. Throws OptionError,
  /// ContractError when the graph is empty.
  Navigator(const ViewSource& source, AreaPlanner planner, const NavigatorOptions& options = {});
  ~Navigator();
  /// The source of a move may only be destroyed or assigned to.
  Navigator(Navigator&& other) noexcept;
  Navigator& operator=(Navigator&& other) noexcept;

  /// Begins a run. The robot's place stays known, blocked edges are unblocked. Throws ContractError
  /// when the view is not in the graph.
  void set_goal(ViewId goal);

  /// Sets recorded routes to follow, which must outlive *this. Without any, `RobotReport::line` is
  /// ignored.
  void set_routes(std::span<const KnownRoute> routes);
  [[nodiscard]] std::span<const KnownRoute> routes() const noexcept;  ///< Same as were set.

  /// Forgets where the robot is: the next observation is searched for in the whole memory.
  void forget_place();

  /// Decides what to do after an observation. After a decision that stops, further ones do too.
  /// Throws ContractError without a goal, and on a signature or line of another shape than the
  /// memory's and the routes'.
  [[nodiscard]] NavigationDecision observe(const FourierSignature& view,
                                           const RobotReport& report = {});

  /// The planner with its graph, its areas and the edges blocked now.
  [[nodiscard]] const AreaPlanner& planner() const noexcept;
  /// Returns the number of loaded views: of an area and its surroundings, and prefetched ones of
  /// the next area.
  [[nodiscard]] std::size_t loaded_views() const noexcept;

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

}  // namespace panonav
