#include "panonav/navigation/navigator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/navigation/internal/navigator_core.hpp"

namespace panonav {

namespace {

/// Largest difference between the home vector to the next reference and the direction field at
/// which the home vector is used: twice the 30 degrees by which neighbours on a grid's diagonal may
/// differ from the path.
constexpr double max_correction_rad = std::numbers::pi / 3.0;
/// A detour by a larger angle is not counted as an attempt at the edge ahead, as it advances along
/// the edge by half a step or less.
constexpr double max_attempt_detour_rad = 1.0;
/// Length, in median edge lengths, from which an edge is followed to its end, because no references
/// are along it.
constexpr double min_long_edge_factor = 2.0;
/// Number of steps per median edge length: `step_m` is about half of that length.
constexpr double steps_per_edge_length = 2.0;
/// Smallest number of components from which a home vector can be computed.
constexpr int min_components = 3;

MemoryScales learn_scales(const ViewSource& source, const AreaPlanner& planner,
                          const NavigatorOptions& options) {
  const NavigationGraph& graph = planner.graph();
  require(graph.size() > 0, "views of the graph", 0.0, ">= 1");
  const ViewId first = graph.view(0);
  const VisualMemory memory = source.load({&first, 1});
  MemoryScales scales;
  scales.full_scale = memory.full_scale();
  scales.components = memory.shape().components;
  const int coarse = options.coarse_components;
  require(coarse == 0 || coarse >= min_components, "coarse_components", coarse, "0, or 3 or more");
  if (coarse < scales.components) scales.coarse_components = coarse;
  scales.place = learn_place_scale(source, graph);
  scales.coarse = scales.coarse_components == 0
                      ? scales.place
                      : learn_place_scale(source, graph, scales.coarse_components);
  std::vector<double> lengths;
  for (const NavigationGraph::Edge& edge : graph.edges()) lengths.push_back(edge.length);
  if (!lengths.empty()) scales.median_edge_length = upper_median(std::move(lengths));
  scales.is_narrow = find_bottlenecks(graph, planner.areas(), options.near_links);
  return scales;
}

}  // namespace

Navigator::Core::Core(const ViewSource& source_, AreaPlanner planner_,
                      const NavigatorOptions& options_)
    : source(&source_),
      planner(std::move(planner_)),
      options(options_),
      // Loads one edge more than is searched, so that the next place and the references compared
      // there are loaded on both sides of a border.
      views(source_, options_.near_links + 1),
      criterion(source_) {
  validate(options);
  scales = learn_scales(source_, planner, options);
}

void Navigator::Core::set_goal(ViewId view) {
  if (planner.blocked_edge_count() > 0) planner.unblock_all();
  planner.set_goal(view);
  const std::size_t node = *graph().node_of(view);
  const auto around = nodes_around(graph(), {&node, 1}, options.near_links);
  goal = {node,
          {around.begin(), around.end()},
          homing_view(source->load({&view, 1}).signature(view)),
          learn_arrival_scale(*source, graph(), view)};
  homing.reset();
  pilot.end_leg();
  pilot.allow_all_routes();
  place.doubt = {};
  last = {};
  obstruction = {};
  progress = {};
  state = NavigationDecision::State::moving;
  replan();
}

void Navigator::Core::forget_place() {
  place = {};
  last = {};
  homing.reset();
  pilot.end_leg();
  plan.committed.reset();
}

// Ends homing, the committed edge and the route leg, because the robot is not where it was assumed
// to be.
void Navigator::Core::abandon_plans(Step& step) {
  homing.reset();
  plan.committed.reset();
  if (pilot.is_on_leg()) step.add_event(NavigationDecision::Event::route_left);
  pilot.end_leg();
}

void Navigator::Core::replan() {
  plan = {};
  if (views.area()) plan.field = planner.field(*views.area());
  progress.min_path_length = std::numeric_limits<double>::infinity();
}

const Guide& Navigator::Core::guide() const {
  return plan.field.at(planner.areas().index_in_area[*place.node]);
}

// Commits to a long edge, to a crossing between two components, or to an edge to whose start the
// robot has come back without an obstruction: then a reference next to the edge has misled it.
void Navigator::Core::commit_to_edge_if_needed(Step& step) {
  const double length = relative_length(guide());
  const bool is_crossing = graph().edges()[guide().edge].is_crossing;
  const bool came_back = progress.steps_without_progress >= options.min_agreeing_steps &&
                         !progress.was_obstructed() &&
                         guide().path_length <= progress.min_path_length && length > 0.0;
  if (plan.committed || (length < min_long_edge_factor && !came_back && !is_crossing)) return;
  if (is_crossing) step.add_event(NavigationDecision::Event::crossing);
  const double steps = steps_per_edge_length * std::max(1.0, length);
  plan.committed = {*place.node, guide(), static_cast<int>(std::ceil(steps))};
}

void Navigator::Core::home_to_goal(Step& step) {
  const ArrivalScale& arrival = goal->arrival;
  if (!homing) {
    HomingPursuitOptions pursuit = options.homing;
    pursuit.max_step_m = std::min(pursuit.max_step_m, options.step_m);
    pursuit.arrived_difference = arrival.max_difference;
    // Stops at a quarter of the arrival length to leave a margin for the home vector's error.
    pursuit.stop_length = 0.25 * arrival.max_length;
    homing.emplace(goal->view, pursuit);
    step.add_event(NavigationDecision::Event::homing);
  }
  const HomingPursuit::Decision pursued = homing->decide(step.view.view);
  NavigationDecision& decision = step.decision;
  decision.homing = true;
  decision.difference = pursued.difference;
  decision.next = graph().view(goal->node);
  decision.direction_rad = pursued.turn_rad;
  decision.advance_m = pursued.advance_m;
  const bool is_obstructed = obstruction.level >= 2 * options.min_agreeing_steps;
  if (pursued.state == HomingPursuit::State::moving && !is_obstructed) return;
  // Homing may also stop without a short vector, so arrival is tested here. Noise and new objects
  // raise the difference, so a larger difference is accepted if the vector is shorter.
  const double length = pursued.vector.length();
  if ((pursued.difference <= arrival.max_difference && length <= arrival.max_length) ||
      (pursued.difference <=
           std::max(2.0 * arrival.max_difference, scales.place.max_difference()) &&
       length <= 0.5 * arrival.max_length)) {
    state = NavigationDecision::State::arrived;
    return;
  }
  step.add_event(NavigationDecision::Event::homing_failed);
  homing.reset();
  obstruction.level = 0;
  unblock_edges_or_end(
      step, is_obstructed ? NavigationDecision::State::blocked : NavigationDecision::State::lost);
}

// Returns the direction to where the robot last knew its place. Uses its own steps, because a near
// obstacle may hide the reference; if it has hardly moved, uses the home vector.
std::optional<double> Navigator::Core::direction_to_known_place(const QueryView& view) {
  if (const auto& known = place.known_position_m;
      known && std::hypot(known->x_m, known->y_m) >= 0.5 * options.step_m) {
    return std::atan2(known->y_m, known->x_m);
  }
  const HomeVector back = home_vector(
      views.read_coefficients(graph().view(*place.known_node), view.components), view.view);
  if (!back.has_direction()) return std::nullopt;
  return back.direction_rad();
}

// Decides to move back from an unknown place to the last known one. Returns false if that direction
// is unknown.
bool Navigator::Core::return_to_known_place(Step& step) {
  if (!place.known_node || obstruction.is_present) return false;
  const std::size_t node = *place.known_node;
  if (!views.holds(graph().view(node))) return false;
  const auto direction_rad = direction_to_known_place(step.view);
  if (!direction_rad) return false;
  const SubAreas& areas = planner.areas();
  if (place.doubt.unknown_steps == options.min_agreeing_steps &&
      areas.area_of[node] == views.area()) {
    // Something hides the next place, so this counts as an obstructed attempt.
    const Guide& ahead = plan.field.at(areas.index_in_area[node]);
    if (ahead.is_reachable() && ahead.next != node) {
      EdgeAttempts& attempts = progress.get_or_create_attempts(ahead.edge, node);
      ++attempts.steps;
      attempts.obstructed_steps += 2;
    }
  }
  step.decision.next = graph().view(node);
  step.decision.direction_rad = *direction_rad;
  step.decision.advance_m = options.step_m;
  last.direction_rad = direction_rad;
  return true;
}

// True at the goal, and at a reference so near to the goal that the goal has no reliable direction
// (as between views of several drives) or that a step would pass it.
bool Navigator::Core::is_at_goal() const {
  if (*place.node == goal->node) return true;
  const bool is_around = goal->around.contains(*place.node);
  // Once begun, homing continues at all references around the goal.
  if (homing && is_around) return true;
  if (!path_reductions.empty() && is_around &&
      guide().path_length <= 0.5 * upper_median(path_reductions)) {
    return true;
  }
  if (guide().next != goal->node) return false;
  const auto motion = graph().motion_from(*place.node, guide().edge);
  return motion && std::hypot(motion->x_m, motion->y_m) <= 0.5 * scales.median_edge_length;
}

// Returns the direction of an edge in the robot's frame: the field's direction rotated by the
// compass, corrected by half the difference to the home vector's direction to the end of the edge.
// On a crossing that vector alone counts. nullopt if neither is available.
std::optional<double> Navigator::Core::direction_along_edge(std::size_t from, const Guide& ahead,
                                                            const Step& step) {
  std::optional<double> direction;
  if (views.holds(graph().view(from))) {
    const auto compass = views.read_compass(graph().view(from), step.view);
    if (compass && ahead.direction_rad) {
      direction = wrap_angle(*ahead.direction_rad - compass->heading_rad);
    }
  }
  const ViewId next = graph().view(ahead.next);
  if (!views.holds(next)) return direction;
  const HomeVector to_next =
      home_vector(views.read_coefficients(next, step.view.components), step.view.view);
  if (!to_next.has_direction()) return direction;
  const double next_rad = to_next.direction_rad();
  if (graph().edges()[ahead.edge].is_crossing) return next_rad;
  const std::optional<double> expected =
      direction || obstruction.is_present ? direction : step.last_direction_rad;
  const double off = expected ? angle_difference(next_rad, *expected) : 0.0;
  return std::abs(off) < max_correction_rad ? next_rad - 0.5 * off : direction;
}

void Navigator::Core::follow_field(Step& step) {
  if (place.doubt.unknown_steps > 0 && return_to_known_place(step)) return;
  commit_to_edge_if_needed(step);
  const std::size_t from = plan.committed ? plan.committed->from : *place.node;
  const Guide ahead = plan.committed ? plan.committed->guide : guide();
  std::optional<double> direction = direction_along_edge(from, ahead, step);
  // If no view gives a direction, the robot continues in that of the last step.
  if (!direction) direction = obstruction.is_present ? 0.0 : step.last_direction_rad.value_or(0.0);
  double detour = detour_rad();
  if (obstruction.is_present && place.doubt.unknown_steps > 0 && step.last_direction_rad) {
    // Moves back from the obstacle that hides the place, until the place is recognised.
    direction = step.last_direction_rad;
    detour = std::numbers::pi;
  }
  step.decision.next = graph().view(ahead.next);
  step.decision.direction_rad = wrap_angle(*direction + detour);
  step.decision.advance_m = options.step_m;
  last.direction_rad = step.decision.direction_rad;
  ++progress.get_or_create_attempts(ahead.edge, from).steps;
  if (obstruction.level >= 2 || std::abs(detour) < max_attempt_detour_rad)
    last.target_edge = ahead.edge;
}

// Begins a leg along a recorded route if the place is certain and nothing has obstructed the robot,
// since what blocks an edge may also block the route.
void Navigator::Core::begin_leg_if_possible(Step& step) {
  if (pilot.routes().empty() || step.report.line.empty() || obstruction.is_present ||
      place.doubt.unknown_steps > 0 || place.doubt.other_place_steps > 0 ||
      planner.blocked_edge_count() > 0) {
    return;
  }
  std::vector<ViewId> path;
  for (const std::size_t node : planner.plan_path(*place.node)) path.push_back(graph().view(node));
  if (!pilot.begin_leg(path, step.report.line, options.min_leg_m)) return;
  plan.committed.reset();
  step.add_event(NavigationDecision::Event::route);
}

// Repeats a recorded route [Y03]. Returns false if the robot is not on a leg.
bool Navigator::Core::follow_route(Step& step) {
  if (!pilot.is_on_leg()) {
    begin_leg_if_possible(step);
  } else if (pilot.unknown_steps() >= options.min_agreeing_steps ||
             obstruction.level >= 2 * options.min_agreeing_steps ||
             progress.steps_without_progress > max_steps_without_progress()) {
    pilot.abandon_leg();
    step.add_event(NavigationDecision::Event::route_left);
    // The robot has not yet tried the planned edges here, so their attempts are reset.
    progress.edge_attempts.clear();
    obstruction.level = progress.steps_without_progress = 0;
  }
  if (!pilot.is_on_leg()) return false;
  const auto target = pilot.target();
  if (!target) {
    pilot.end_leg();
    return false;
  }
  NavigationDecision& decision = step.decision;
  decision.on_route = true;
  decision.next = pilot.end();
  decision.direction_rad = std::atan2(target->y_m, target->x_m);
  // The straight line to the target stays near the route, and odometry errs little over one step.
  decision.advance_m = std::min(options.step_m, std::hypot(target->x_m, target->y_m));
  last.direction_rad = decision.direction_rad;
  return true;
}

// [M04 section 3.5]
void Navigator::Core::decide(Step& step) {
  locate(step);
  if (state == NavigationDecision::State::moving) block_failed_edges(step);
  if (state == NavigationDecision::State::moving && !guide().is_reachable() &&
      !relocalise_with_path(step)) {
    unblock_edges_or_end(step, NavigationDecision::State::unreachable);
    // Unreachable even with all edges unblocked.
    if (!guide().is_reachable()) state = NavigationDecision::State::unreachable;
  }
  update_probability(step);
  last = {};
  if (state == NavigationDecision::State::moving) choose_motion(step);
  if (state == NavigationDecision::State::moving && progress.steps >= options.max_run_steps) {
    state = NavigationDecision::State::blocked;
  }
  last.view = step.view.view;
  last.advance_m = step.decision.advance_m;
  if (last.advance_m == options.step_m && !homing) last.path_length = guide().path_length;
}

void Navigator::Core::choose_motion(Step& step) {
  // At an unknown place the robot waits until `min_agreeing_steps` observations were unknown; then
  // it uses the best guess.
  const int unknown_steps = place.doubt.unknown_steps;
  if (unknown_steps > 0 && unknown_steps < options.min_agreeing_steps && !obstruction.is_present) {
    return;
  }
  if (is_at_goal()) {
    pilot.end_leg();
    home_to_goal(step);
    return;
  }
  homing.reset();
  if (!follow_route(step)) follow_field(step);
}

NavigationDecision Navigator::Core::observe(const FourierSignature& view,
                                            const RobotReport& report) {
  if (!goal) throw ContractError("goal", "none", "one that was set");
  const int number = ++progress.steps;
  if (state != NavigationDecision::State::moving) {
    NavigationDecision stopped{.step = number, .state = state};
    if (place.node) stopped.nearest = graph().view(*place.node);
    return stopped;
  }
  const std::uint64_t bytes_before = views.bytes_read();
  if (pilot.is_on_leg()) pilot.track(report.line, report.moved);
  const int components = needs_all_components() ? 0 : scales.coarse_components;
  Step step{view, report, QueryView(view, scales.full_scale, components), {.step = number}, {}};
  decide(step);
  NavigationDecision& decision = step.decision;
  decision.state = state;
  if (state != NavigationDecision::State::moving) decision.advance_m = 0.0;
  decision.nearest = graph().view(*place.node);
  decision.area = *views.area();
  decision.path_length = guide().path_length;
  decision.components = step.view.components;
  decision.bytes_read = views.bytes_read() - bytes_before;
  // Does not prefetch after entering an area, which has loaded many views already.
  const bool entered_area =
      std::ranges::find(decision.events, NavigationDecision::Event::entered_area) !=
      decision.events.end();
  if (state == NavigationDecision::State::moving && !entered_area) prefetch_next_area();
  return std::move(decision);
}

std::string_view to_string(NavigationDecision::State state) {
  constexpr std::array<std::string_view, 5> names{"moving", "arrived", "blocked", "lost",
                                                  "unreachable"};
  return names.at(static_cast<std::size_t>(state));
}

std::string_view to_string(NavigationDecision::Event event) {
  constexpr std::array<std::string_view, 12> names{
      "relocalised", "kidnapped", "entered_area",  "unknown_place", "obstructed", "closed",
      "reopened",    "homing",    "homing_failed", "crossing",      "route",      "route_left"};
  return names.at(static_cast<std::size_t>(event));
}

std::string describe(const NavigationDecision& decision) {
  std::string line = std::to_string(decision.step) + " " + std::string(to_string(decision.state));
  if (decision.nearest) {
    line += " at view " + std::to_string(decision.nearest->value) + " (probability " +
            to_fixed_text(decision.probability, 2) + ")";
  }
  if (decision.next) line += " to view " + std::to_string(decision.next->value);
  line += " in area " + std::to_string(decision.area);
  line += ", path left " + to_general_text(decision.path_length, 4) + ", difference " +
          to_fixed_text(decision.difference, 3);
  if (decision.advance_m > 0.0) {
    const char* how = decision.homing ? "home" : decision.on_route ? "along a route" : "go";
    line += std::string(", ") + how + " " + to_fixed_text(decision.advance_m, 3) + " m towards " +
            to_fixed_text(degrees(decision.direction_rad), 1) + " degrees";
  }
  for (const NavigationDecision::Event event : decision.events)
    line += ", " + std::string(to_string(event));
  return line;
}

void visit_options(NavigatorOptions& options, OptionVisitor& visitor) {
  using T = NavigatorOptions;
  constexpr OptionTable table{
      option<&T::step_m>("length of the longest step", 0.001, 100),
      option<&T::near_links>(
          "search for the next place within this number of edges from the last place", 1, 10),
      option<&T::coarse_components>("number of Fourier components compared in open space; 0: all",
                                    0, 1000),
      option<&T::views_ahead>("number of views of the next area that are loaded in each step", 0,
                              1e6),
      options_of<&T::homing>(),
      option<&T::min_agreeing_steps>(
          "number of steps that must agree before a new place or a blocked edge is accepted", 1,
          1000),
      option<&T::lost_patience>(
          "number of steps without a known place after which the robot is lost", 1, 1e6),
      option<&T::edge_patience>("number of steps without progress after which an edge is blocked",
                                1, 1e6),
      option<&T::min_leg_m>("shortest part of a path for which a recorded route is used", 0.001,
                            1000),
      option<&T::attempts>("number of attempts at blocked edges and at homing", 1, 1000),
      option<&T::max_run_steps>("largest number of steps of the whole drive", 1, 1e9),
  };
  table.visit(options, visitor);
}

Navigator::Navigator(const ViewSource& source, AreaPlanner planner, const NavigatorOptions& options)
    : core_(std::make_unique<Core>(source, std::move(planner), options)) {}
Navigator::~Navigator() = default;
Navigator::Navigator(Navigator&& other) noexcept = default;
Navigator& Navigator::operator=(Navigator&& other) noexcept = default;

void Navigator::set_goal(ViewId goal) {
  core_->set_goal(goal);
}
void Navigator::set_routes(std::span<const KnownRoute> routes) {
  core_->pilot = RoutePilot(routes);
}
std::span<const KnownRoute> Navigator::routes() const noexcept {
  return core_->pilot.routes();
}
void Navigator::forget_place() {
  core_->forget_place();
}
NavigationDecision Navigator::observe(const FourierSignature& view, const RobotReport& report) {
  return core_->observe(view, report);
}
const AreaPlanner& Navigator::planner() const noexcept {
  return core_->planner;
}
std::size_t Navigator::loaded_view_count() const noexcept {
  return core_->views.size();
}

}  // namespace panonav
