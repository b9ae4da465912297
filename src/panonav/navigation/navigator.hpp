#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/homing/homing_pursuit.hpp"
#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/area_planner.hpp"
#include "panonav/navigation/area_views.hpp"
#include "panonav/navigation/place_scale.hpp"
#include "panonav/navigation/route_pilot.hpp"

namespace panonav {

struct NavigatorOptions {
  double step_m = 0.25;  ///< longest way between two looks; about half the references' spacing
  int near_links = 2;    ///< the next place is looked for within so many passages of the last one
  /// Of the signatures, compared in the open: 3 or more, or 0 for all. All are compared so many
  /// passages around narrow gates and the goal, and where a place is in doubt.
  int coarse_components = 6;
  /// Views of the area that comes next which a look loads, so that none waits for all of them. 0:
  /// none ahead.
  int views_ahead = 20;
  /// The last stretch. Its difference and length of arrival come from the references around the
  /// goal, its longest step is `step_m` at most.
  HomingPursuitOptions homing;
  int agreeing_looks = 3;  ///< looks that must agree before another place or a block is believed
  int lost_patience = 12;  ///< looks without a known place after which the robot is lost
  /// Looks without coming nearer to the goal, more along a longer passage than usual; from half of
  /// them on the robot searches around. Then the passage that was tried most counts as blocked.
  int passage_patience = 8;
  /// Of the way along a recorded route that is worth a leg: three steps.
  double shortest_leg_m = 0.75;
  int attempts = 3;       ///< times that closed passages, or the last stretch, are tried
  int most_looks = 5000;  ///< after which a run ends as blocked
};
void visit_options(NavigatorOptions& options, OptionVisitor& visitor);

enum class NavigationState {
  moving,
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
  closed,         ///< passages were closed and the way planned anew
  reopened,       ///< closed passages are tried again
  homing,         ///< the last stretch begins
  homing_failed,  ///< the last stretch ended at another place
  route,          ///< a leg along a recorded route begins
  route_left,     ///< it did not come to its end
};
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
  /// The horizon line of this look (route/horizon_line.hpp), for legs along routes; empty: none.
  std::span<const float> line;
  /// How the robot moved since its last look as its odometry has it, in the frame that it had then;
  /// for legs along routes.
  Pose2 moved;
};

/// One decision with its reasons: the log entry of a look.
struct NavigationDecision {
  int look = 0;  ///< counts from 1
  NavigationState state = NavigationState::moving;
  double direction_rad = 0.0;     ///< in which to go, in the current robot frame
  double advance_m = 0.0;         ///< how far; 0 unless moving
  bool homing = false;            ///< the last stretch, by the home vector to the goal itself
  bool on_route = false;          ///< a leg along a recorded route, by the horizon line
  std::optional<ViewId> nearest;  ///< the place
  std::optional<ViewId> next;     ///< the reference ahead; of a leg that at its end
  std::size_t area = 0;           ///< that is loaded
  double difference =
      0.0;             ///< of what is seen from `nearest` (homing: the goal), `image_difference`
  double way = 0.0;    ///< that is left along the passages, in the graph's unit
  int components = 0;  ///< of the signatures, by which references were compared
  std::uint64_t bytes_read = 0;  ///< of the loaded area's signatures and index, by this look
  std::vector<NavigationEvent> events;
};
/// A line for a log.
[[nodiscard]] std::string describe(const NavigationDecision& decision);

/// Goes to a place over the memory by views alone [M04 section 3.5]: look, find the nearest
/// reference, take its direction, move, look again; the last stretch by homing. As every look
/// decides anew, neither a distorted map nor a step that leads elsewhere matters. Where the way
/// goes along a recorded route and the robot tells its horizon lines, it repeats the route instead
/// [Y03]; views still tell its place, and that it was carried away.
///
/// Holds the state of a run, and of the memory the views of one area, two at a border. Knows
/// nothing of how the robot moves: `command_towards` (motion/velocity.hpp) does. Same calls, same
/// bits. Cost of a look without a change of area: the search among the loaded views and three home
/// vectors at most; with a line near a route also a plan, `RoutePilot::begin`, or a fit.
class Navigator {
 public:
  /// The source must hold all views of the planner's graph and outlive *this. Throws OptionError,
  /// ContractError when the graph is empty.
  Navigator(const ViewSource& source, AreaPlanner planner, const NavigatorOptions& options = {});

  /// A new run; where the robot is stays known, closed passages are opened. Throws ContractError
  /// when the view is not in the graph.
  void set_goal(ViewId goal);

  /// Recorded routes to go along, which must outlive *this; none at first, and `RobotReport::line`
  /// is not looked at.
  void set_routes(std::span<const KnownRoute> routes) { pilot_ = RoutePilot(routes); }
  [[nodiscard]] std::span<const KnownRoute> routes() const noexcept { return pilot_.routes(); }

  /// The robot may be anywhere: the next look searches the whole memory.
  void forget_place();

  /// What to do after a look. After a decision that stops, further ones do too. Throws
  /// ContractError without a goal, and on a signature or line of another shape than the memory's
  /// and the routes'.
  [[nodiscard]] NavigationDecision look(const FourierSignature& view,
                                        const RobotReport& report = {});

  [[nodiscard]] const AreaPlanner& planner() const noexcept { return planner_; }
  [[nodiscard]] const PlaceScale& place_scale() const noexcept { return scale_; }
  [[nodiscard]] const ArrivalScale& arrival_scale() const noexcept { return arrival_; }
  /// Views in memory now: of an area and its surroundings, and what is loaded ahead of the next.
  [[nodiscard]] std::size_t loaded_views() const noexcept { return views_.size(); }

 private:
  struct Seen;
  /// What became of the steps along a passage since the robot came nearer to the goal.
  struct Tries {
    std::size_t node = 0;  // from which it was tried first
    int looks = 0;
    int obstructed = 0;
  };
  struct Located;
  [[nodiscard]] bool needs_all_components() const;
  [[nodiscard]] double limit(const SeenView& view) const noexcept;
  [[nodiscard]] Located search_around(const SeenView& view);
  /// A passage that is held to until its end: other references may be nearer on the way.
  struct UnderWay {
    std::size_t from = 0;  // node
    Guide guide;           // there
    int looks_left = 0;
  };
  [[nodiscard]] double relative_length(const Guide& ahead) const;
  void begin_long_way();
  void locate(Seen& seen, const RobotReport& report, NavigationDecision& decision);
  void accept(const Located& located, NavigationDecision& decision);
  void load_ahead();
  void relocalise(const Seen& seen, NavigationDecision& decision);
  void enter(std::size_t node, NavigationDecision& decision);
  void notice_obstacles(const Seen& seen, const RobotReport& report, NavigationDecision& decision);
  void count_try();
  void close_way(std::size_t passage, NavigationDecision& decision);
  void try_again(NavigationDecision& decision, NavigationState otherwise);
  [[nodiscard]] bool find_way_from_here(const Seen& seen, NavigationDecision& decision);
  [[nodiscard]] const Guide& guide() const;
  void go_home(const Seen& seen, NavigationDecision& decision);
  [[nodiscard]] std::optional<double> way_back_rad(const SeenView& view);
  [[nodiscard]] bool go_back(const Seen& seen, NavigationDecision& decision);
  [[nodiscard]] bool is_at_goal() const;
  void follow(const Seen& seen, NavigationDecision& decision);
  void forget_plans(NavigationDecision& decision);
  void begin_leg(const RobotReport& report, NavigationDecision& decision);
  [[nodiscard]] bool go_along_route(const RobotReport& report, NavigationDecision& decision);
  void plan_fields();
  [[nodiscard]] int patience() const;
  [[nodiscard]] double detour_rad() const;

  const ViewSource* source_;
  AreaPlanner planner_;
  NavigatorOptions options_;
  PlaceScale scale_;
  PlaceScale coarse_scale_;
  ArrivalScale arrival_;
  float full_scale_ = 1.0F;
  int components_ = 0;                 // of the memory
  int coarse_components_ = 0;          // 0: all
  double typical_length_ = 1.0;        // of a passage
  std::vector<std::uint8_t> narrow_;   // by node
  std::set<std::size_t> around_goal_;  // nodes
  AreaViews views_;
  std::vector<Guide> field_;  // of the loaded area

  std::optional<std::size_t> goal_;  // node
  std::optional<HomingView> goal_view_;
  std::optional<HomingPursuit> homing_;
  std::optional<std::size_t> node_;        // where the robot is
  std::optional<std::size_t> known_node_;  // where its place last looked right
  std::optional<Point2> known_at_;         // in the current frame, as far as steps tell; metres
  std::optional<HomingView> last_view_;
  std::optional<double>
      commanded_rad_;         // direction of the step before, in the frame of `last_view_`
  double commanded_m_ = 0.0;  // its length
  std::optional<double> heading_for_rad_;  // the same in the current frame, unless it failed
  NavigationState state_ = NavigationState::moving;
  std::optional<UnderWay> under_way_;
  RoutePilot pilot_;
  int looks_ = 0;
  int unknown_looks_ = 0;
  int elsewhere_looks_ = 0;
  std::optional<std::size_t> elsewhere_;
  bool obstructed_ = false;  // in the step before this look
  int obstruction_ = 0;  // grows by 2 with each step that fails, falls by 1 with each that does not
  int attempts_ = 0;
  int ways_sought_ = 0;                     // from places without one, in this attempt
  double least_way_ = 0.0;                  // since the last plan
  std::optional<double> way_before_;        // at the look before, if a whole step followed
  std::vector<double> ways_of_steps_;       // by which the last ones brought the goal nearer
  int looks_in_vain_ = 0;                   // since the way became shorter or a passage was closed
  bool closed_here_ = false;                // a passage, and the robot was not far from there since
  std::map<std::size_t, Tries> tries_;      // of passages, since the way became shorter
  std::vector<std::size_t> around_closed_;  // nodes around that passage, ascending
  std::set<std::size_t> suspects_;          // passages that were closed in earlier attempts
  std::optional<std::size_t> aimed_for_;    // passage of the step before, unless that led around
};

}  // namespace panonav
