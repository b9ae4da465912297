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

/// How a robot is led over the memory, and when it counts as blocked or lost.
struct NavigatorOptions {
  double step_m =
      0.25;            ///< longest way between two observations; about half the references' spacing
  int near_links = 2;  ///< the next place is looked for within so many edges of the last one
  /// Of the signatures, compared in the open: 3 or more, or 0 for all. All are compared so many
  /// edges around narrow gates and the goal, and where a place is in doubt.
  int coarse_components = 6;
  /// Views of the area that comes next which an observation loads, so that none waits for all of
  /// them. 0: none ahead.
  int views_ahead = 20;
  /// The last stretch. Its difference and length of arrival come from the references around the
  /// goal, its longest step is `step_m` at most.
  HomingPursuitOptions homing;
  int min_agreeing_steps =
      3;  ///< observations that must agree before another place or a block is believed
  /// Observations without a known place, or with a place that is probably not the robot's, after
  /// which it is lost.
  int lost_patience = 12;
  /// Observations without coming nearer to the goal, more along a longer edge than usual; from half
  /// of them on the robot searches around. Then the edge that was tried most counts as blocked.
  int edge_patience = 8;
  /// Of the way along a recorded route that is worth a leg: three steps.
  double min_leg_m = 0.75;
  int attempts = 3;          ///< times that closed edges, or the last stretch, are tried
  int max_run_steps = 5000;  ///< after which a run ends as blocked
};
void visit_options(NavigatorOptions& options, OptionVisitor& visitor);

/// How far a run to a goal has come.
enum class NavigationState {
  moving,       ///< the run goes on
  arrived,      ///< the views say that this is the goal
  blocked,      ///< the robot cannot get on, though there is a way in the memory
  lost,         ///< what the robot sees is nowhere in the memory, or not where it should be
  unreachable,  ///< no way leads to the goal, or all of them turned out to be blocked
};
/// "moving", "arrived", "blocked", "lost", "unreachable".
[[nodiscard]] std::string_view name_of(NavigationState state);

/// What made a decision differ from going on.
enum class NavigationEvent {
  relocalised,    ///< the place was looked for in the whole memory
  kidnapped,      ///< another place than the expected one is accepted
  entered_area,   ///< another area was loaded
  unknown_place,  ///< the reference does not look like what is seen
  obstructed,     ///< the robot could not make its last step
  closed,         ///< edges were closed and the way planned anew
  reopened,       ///< closed edges are tried again
  homing,         ///< the last stretch begins
  homing_failed,  ///< the last stretch ended at another place
  route,          ///< a leg along a recorded route begins
  route_left,     ///< it did not come to its end
};
/// In lower case with underscores, as logs and JSON have it: "relocalised", "entered_area", ...
[[nodiscard]] std::string_view name_of(NavigationEvent event);

/// What a robot tells besides its view.
struct RobotReport {
  /// Something stopped the robot before the last step was done.
  bool obstacle = false;
  /// Where another estimate has the robot: the reference nearest to a position of
  /// `MonteCarloLocaliser`, or the first of `Localiser`. It is taken for the last place, and the
  /// navigator looks around it, so it need not be exact. For places that look alike, where a single
  /// view misleads. Leave it empty where the estimate is not certain: the views decide then.
  std::optional<ViewId> estimate;
  /// The horizon scanline of this observation (route/horizon_scanline.hpp), for legs along routes;
  /// empty: none.
  std::span<const float> line;
  /// How the robot moved since its last observation as its odometry has it, in the frame that it
  /// had then; for legs along routes.
  Pose2 moved;
};

/// One decision with its reasons: the log entry of an observation.
struct NavigationDecision {
  int step = 0;                                     ///< counts from 1
  NavigationState state = NavigationState::moving;  ///< after this observation
  double direction_rad = 0.0;                       ///< in which to go, in the current robot frame
  double advance_m = 0.0;                           ///< how far; 0 unless moving
  bool homing = false;            ///< the last stretch, by the home vector to the goal itself
  bool on_route = false;          ///< a leg along a recorded route, by the horizon scanline
  std::optional<ViewId> nearest;  ///< the place
  /// That the robot is there: `place_probability` of what is seen, with the difference of `nearest`
  /// instead of the best match's. 0 once the run has ended.
  double probability = 0.0;
  std::optional<ViewId> next;  ///< the reference ahead; of a leg that at its end
  std::size_t area = 0;        ///< that is loaded
  double difference =
      0.0;             ///< of what is seen from `nearest` (homing: the goal), `image_difference`
  double way = 0.0;    ///< that is left along the edges, in the graph's unit
  int components = 0;  ///< of the signatures, by which references were compared
  /// Of the loaded area's signatures and index, by this observation, `probability` not included.
  std::uint64_t bytes_read = 0;
  std::vector<NavigationEvent> events;  ///< in the order in which they happened
};
/// A line for a log.
[[nodiscard]] std::string describe(const NavigationDecision& decision);

/// Goes to a place over the memory by views alone [M04 section 3.5]: observe, find the
/// nearest reference, take its direction, move, observe again; the last stretch by homing. As every
/// observation decides anew, neither a distorted map nor a step that leads elsewhere matters. Where
/// the way goes along a recorded route and the robot tells its horizon scanlines, it repeats the
/// route instead [Y03]; views still tell its place, and that it was kidnapped.
///
/// Holds the state of a run, and of the memory the views of one area, two at a border. Knows
/// nothing of how the robot moves: `compute_command_towards` (motion/velocity.hpp) does. Same
/// calls, same bits. Cost of an observation without a change of area: the search among the loaded
/// views and three home vectors at most; with a line near a route also a plan, `RoutePilot::begin`,
/// or a fit.
class Navigator {
 public:
  /// The source must hold all views of the planner's graph and outlive *this. Throws OptionError,
  /// ContractError when the graph is empty.
  Navigator(const ViewSource& source, AreaPlanner planner, const NavigatorOptions& options = {});
  ~Navigator();
  /// What is left of the other may only be destroyed or assigned to.
  Navigator(Navigator&& other) noexcept;
  Navigator& operator=(Navigator&& other) noexcept;

  /// A new run; where the robot is stays known, closed edges are opened. Throws ContractError
  /// when the view is not in the graph.
  void set_goal(ViewId goal);

  /// Recorded routes to go along, which must outlive *this; none at first, and `RobotReport::line`
  /// is not looked at.
  void set_routes(std::span<const KnownRoute> routes);
  [[nodiscard]] std::span<const KnownRoute> routes() const noexcept;  ///< As they were set.

  /// The robot may be anywhere: the next observation is searched for in the whole memory.
  void forget_place();

  /// What to do after an observation. After a decision that stops, further ones do too. Throws
  /// ContractError without a goal, and on a signature or line of another shape than the memory's
  /// and the routes'.
  [[nodiscard]] NavigationDecision observe(const FourierSignature& view,
                                           const RobotReport& report = {});

  /// What plans are made by, with its graph, its areas and the edges that are closed now.
  [[nodiscard]] const AreaPlanner& planner() const noexcept;
  /// Views in memory now: of an area and its surroundings, and what is loaded ahead of the next.
  [[nodiscard]] std::size_t loaded_views() const noexcept;

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

}  // namespace panonav
