#include "panonav/navigation/navigator.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/navigation/internal/navigator_core.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

namespace {

// A vector of less confidence is as likely as not but the error of reading it.
constexpr double min_confidence = 0.5;
// The next reference as the robot sees it now counts where it does not contradict the field.
constexpr double max_correction_rad = std::numbers::pi / 3.0;
// A search step that is turned aside by more says nothing about the edge ahead.
constexpr double max_aside_rad = 1.0;
// An edge so much longer than usual is held to until its end. `step_m` is half a usual edge.
constexpr double min_long = 2.0;
constexpr double steps_of_edge = 2.0;
// Fewer tell no home vector.
constexpr int min_components = 3;

MemoryScales learn_scales(const ViewSource& source, const AreaPlanner& planner,
                          const NavigatorOptions& options) {
  const NavigationGraph& graph = planner.graph();
  require(graph.size() > 0, "views of the graph", 0.0, ">= 1");
  const ViewId first = graph.view(0);
  const VisualMemory one = source.load({&first, 1});
  MemoryScales scales;
  scales.full_scale = one.full_scale();
  scales.components = one.shape().components;
  const int coarse = options.coarse_components;
  require(coarse == 0 || coarse >= min_components, "coarse_components", coarse, "0, or 3 or more");
  if (coarse < scales.components) scales.coarse_components = coarse;
  scales.place = learn_place_scale(source, graph);
  scales.coarse = scales.coarse_components == 0
                      ? scales.place
                      : learn_place_scale(source, graph, scales.coarse_components);
  std::vector<double> lengths;
  for (const NavigationGraph::Edge& edge : graph.edges()) lengths.push_back(edge.length);
  if (!lengths.empty()) scales.typical_length = upper_median(std::move(lengths));
  scales.narrow = find_narrow_places(graph, planner.areas(), options.near_links);
  return scales;
}

}  // namespace

Navigator::Core::Core(const ViewSource& source_, AreaPlanner planner_,
                      const NavigatorOptions& options_)
    : source(&source_),
      planner(std::move(planner_)),
      options(options_),
      // The next place and what is looked at there are at hand on both sides of a border.
      views(source_, options_.near_links + 1),
      criterion(source_) {
  validate(options);
  scales = learn_scales(source_, planner, options);
}

void Navigator::Core::set_goal(ViewId view) {
  if (planner.closed() > 0) planner.unblock_all();
  planner.set_goal(view);
  const std::size_t node = *graph().node_of(view);
  const auto around = nodes_around(graph(), {&node, 1}, options.near_links);
  goal = {node,
          {around.begin(), around.end()},
          homing_view(source->load({&view, 1}).signature(view)),
          learn_arrival_scale(*source, graph(), view)};
  homing.reset();
  pilot.stop();
  pilot.forgive();
  place.doubt = {};
  last = {};
  obstruction = {};
  progress = {};
  state = NavigationState::moving;
  plan_anew();
}

void Navigator::Core::forget_place() {
  place = {};
  last = {};
  homing.reset();
  pilot.stop();
  plan.under_way.reset();
}

// The robot is not where it was taken for: what it held to there does not lead on.
void Navigator::Core::forget_plans(Step& step) {
  homing.reset();
  plan.under_way.reset();
  if (pilot.drives()) step.note(NavigationEvent::route_left);
  pilot.stop();
}

// The field of the loaded area, and what it is to bring the robot nearer, start anew.
void Navigator::Core::plan_anew() {
  plan = {};
  if (views.area()) plan.field = planner.field(*views.area());
  progress.min_way = std::numeric_limits<double>::infinity();
}

const Guide& Navigator::Core::guide() const {
  return plan.field.at(planner.areas().place_of[*place.node]);
}

// Along a long edge the robot goes on for its end, whatever reference is nearest meanwhile;
// along any other when it has come back to where that begins though nothing stood in the way: then
// a reference beside it has sent it back.
void Navigator::Core::begin_long_way() {
  const double length = relative_length(guide());
  const bool came_back = progress.steps_in_vain >= options.min_agreeing_steps &&
                         !progress.was_obstructed() && guide().way <= progress.min_way &&
                         length > 0.0;
  if (plan.under_way || (length < min_long && !came_back)) return;
  const double steps = steps_of_edge * std::max(1.0, length);
  plan.under_way = {*place.node, guide(), static_cast<int>(std::ceil(steps))};
}

void Navigator::Core::go_home(Step& step) {
  const ArrivalScale& arrival = goal->arrival;
  if (!homing) {
    HomingPursuitOptions pursuit = options.homing;
    pursuit.max_step_m = std::min(pursuit.max_step_m, options.step_m);
    pursuit.arrived_difference = arrival.difference;
    // Well inside: the vector has an error of its own.
    pursuit.stop_length = 0.25 * arrival.length;
    homing.emplace(goal->view, pursuit);
    step.note(NavigationEvent::homing);
  }
  const HomingPursuit::Decision pursued = homing->decide(step.view.view);
  NavigationDecision& decision = step.decision;
  decision.homing = true;
  decision.difference = pursued.difference;
  decision.next = graph().view(goal->node);
  decision.direction_rad = pursued.turn_rad;
  decision.advance_m = pursued.advance_m;
  const bool obstructed = obstruction.level >= 2 * options.min_agreeing_steps;
  if (pursued.state == HomingPursuit::State::moving && !obstructed) return;
  // Homing may stop for other reasons than a short vector; the place decides. Noise and new things
  // in view make a difference, too: a robot that sees no way left is there when the place may be
  // this one.
  const double length = pursued.vector.length();
  if ((pursued.difference <= arrival.difference && length <= arrival.length) ||
      (pursued.difference <= std::max(2.0 * arrival.difference, scales.place.limit()) &&
       length <= 0.5 * arrival.length)) {
    state = NavigationState::arrived;
    return;
  }
  step.note(NavigationEvent::homing_failed);
  homing.reset();
  obstruction.level = 0;
  try_again(step, obstructed ? NavigationState::blocked : NavigationState::lost);
}

// The direction of where the robot still knew its place: the way back of its own steps, as
// something near may hide what the reference there shows; else as the reference is seen from here.
std::optional<double> Navigator::Core::way_back_rad(const SeenView& view) {
  if (place.known_at &&
      std::hypot(place.known_at->x_m, place.known_at->y_m) >= 0.5 * options.step_m) {
    return std::atan2(place.known_at->y_m, place.known_at->x_m);
  }
  const HomeVector back =
      home_vector(views.view(graph().view(*place.known_node), view.components), view.view);
  if (back.confidence <= min_confidence) return std::nullopt;
  return back.direction_rad();
}

// From an unknown place to where the robot still knew its own, if something tells where that is.
bool Navigator::Core::go_back(Step& step) {
  if (!place.known_node || obstruction.now) return false;
  const std::size_t node = *place.known_node;
  if (!views.holds(graph().view(node))) return false;
  const auto direction_rad = way_back_rad(step.view);
  if (!direction_rad) return false;
  const SubAreas& areas = planner.areas();
  if (place.doubt.unknown_steps == options.min_agreeing_steps &&
      areas.area_of[node] == views.area()) {
    // Something hides the place that should come next, as what stands in the way does.
    const Guide& ahead = plan.field.at(areas.place_of[node]);
    if (ahead.reachable() && ahead.next != node) {
      EdgeTries& tries =
          progress.tries.try_emplace(ahead.edge, EdgeTries{node, 0, 0}).first->second;
      ++tries.steps;
      tries.obstructed += 2;
    }
  }
  step.decision.next = graph().view(node);
  step.decision.direction_rad = *direction_rad;
  step.decision.advance_m = options.step_m;
  last.direction_rad = direction_rad;
  return true;
}

// The goal, or another reference from which the goal is too near for a direction, as views of
// several drives may be from one place, or for a step, which would lead beyond it.
bool Navigator::Core::is_at_goal() const {
  if (*place.node == goal->node) return true;
  const bool is_around = goal->around.contains(*place.node);
  // The first steps of homing try how far one leads.
  if (homing && is_around) return true;
  if (!step_ways.empty() && is_around && guide().way <= 0.5 * upper_median(step_ways)) return true;
  if (guide().next != goal->node) return false;
  const auto motion = graph().motion_from(*place.node, guide().edge);
  return motion && std::hypot(motion->x_m, motion->y_m) <= 0.5 * scales.typical_length;
}

// Of the reference at the end of an edge, in the frame of the robot, which is turned against the
// view from which the edge begins. Empty where no view tells it.
std::optional<double> Navigator::Core::direction_of(std::size_t from, const Guide& ahead,
                                                    const Step& step) {
  std::optional<double> direction;
  std::optional<CompassReading> turned;
  if (views.holds(graph().view(from))) turned = views.turn_against(graph().view(from), step.view);
  if (ahead.direction_rad && turned) {
    direction = wrap_angle(*ahead.direction_rad - turned->heading_rad);
  }
  const ViewId next = graph().view(ahead.next);
  if (!views.holds(next)) return direction;
  const HomeVector seen = home_vector(views.view(next, step.view.components), step.view.view);
  if (seen.confidence <= min_confidence) return direction;
  const double seen_rad = seen.direction_rad();
  const std::optional<double> known =
      direction || obstruction.now ? direction : step.heading_for_rad;
  const double off = known ? angle_difference(seen_rad, *known) : 0.0;
  return std::abs(off) < max_correction_rad ? seen_rad - 0.5 * off : direction;
}

void Navigator::Core::follow(Step& step) {
  if (place.doubt.unknown_steps > 0 && go_back(step)) return;
  begin_long_way();
  const std::size_t from = plan.under_way ? plan.under_way->from : *place.node;
  const Guide ahead = plan.under_way ? plan.under_way->guide : guide();
  std::optional<double> direction = direction_of(from, ahead, step);
  // Where no view tells the direction, the robot goes on as it went.
  if (!direction) direction = obstruction.now ? 0.0 : step.heading_for_rad.value_or(0.0);
  double detour = detour_rad();
  if (obstruction.now && place.doubt.unknown_steps > 0 && step.heading_for_rad) {
    // What hides the place is left behind to see where this is.
    direction = step.heading_for_rad;
    detour = std::numbers::pi;
  }
  step.decision.next = graph().view(ahead.next);
  step.decision.direction_rad = wrap_angle(*direction + detour);
  step.decision.advance_m = options.step_m;
  last.direction_rad = step.decision.direction_rad;
  ++progress.tries.try_emplace(ahead.edge, EdgeTries{from, 0, 0}).first->second.steps;
  if (obstruction.level >= 2 || std::abs(detour) < max_aside_rad) last.aimed_for = ahead.edge;
}

// A leg along a route, where views leave no doubt of the place and nothing was in the way so far:
// what shut an edge may shut the route, too.
void Navigator::Core::begin_leg(Step& step) {
  if (pilot.routes().empty() || step.report.line.empty() || obstruction.now ||
      place.doubt.unknown_steps > 0 || place.doubt.elsewhere_steps > 0 || planner.closed() > 0) {
    return;
  }
  std::vector<ViewId> way;
  for (const std::size_t node : planner.plan_path(*place.node)) way.push_back(graph().view(node));
  if (!pilot.begin(way, step.report.line, options.min_leg_m)) return;
  plan.under_way.reset();
  step.note(NavigationEvent::route);
}

// Repeats a recorded route; false where there is none to go along, or none any more.
bool Navigator::Core::go_along_route(Step& step) {
  if (!pilot.drives()) {
    begin_leg(step);
  } else if (pilot.unknown_steps() >= options.min_agreeing_steps ||
             obstruction.level >= 2 * options.min_agreeing_steps ||
             progress.steps_in_vain > patience()) {
    pilot.give_up();
    step.note(NavigationEvent::route_left);
    // The way by views has not been tried here.
    progress.tries.clear();
    obstruction.level = progress.steps_in_vain = 0;
  }
  if (!pilot.drives()) return false;
  const auto aim = pilot.aim();
  if (!aim) {
    pilot.stop();
    return false;
  }
  NavigationDecision& decision = step.decision;
  decision.on_route = true;
  decision.next = pilot.end();
  decision.direction_rad = std::atan2(aim->y_m, aim->x_m);
  // The straight way there is near the route; odometry errs by little over a usual step.
  decision.advance_m = std::min(options.step_m, std::hypot(aim->x_m, aim->y_m));
  last.direction_rad = decision.direction_rad;
  return true;
}

void Navigator::Core::decide(Step& step) {
  locate(step);
  if (state == NavigationState::moving) notice_obstacles(step);
  if (state == NavigationState::moving && !guide().reachable() && !find_way_from_here(step)) {
    try_again(step, NavigationState::unreachable);
    // Nothing was closed that could be opened.
    if (!guide().reachable()) state = NavigationState::unreachable;
  }
  judge_place(step);
  last = {};
  // At an unknown place the robot waits for observations to agree; then it goes by the best guess.
  const int unknown_steps = place.doubt.unknown_steps;
  const bool waits =
      unknown_steps > 0 && unknown_steps < options.min_agreeing_steps && !obstruction.now;
  if (state == NavigationState::moving && !waits) {
    if (is_at_goal()) {
      pilot.stop();
      go_home(step);
    } else {
      homing.reset();
      if (!go_along_route(step)) follow(step);
    }
  }
  if (state == NavigationState::moving && progress.steps >= options.max_run_steps) {
    state = NavigationState::blocked;
  }
  last.view = step.view.view;
  last.advance_m = step.decision.advance_m;
  if (last.advance_m == options.step_m && !homing) last.way = guide().way;
}

NavigationDecision Navigator::Core::observe(const FourierSignature& view,
                                            const RobotReport& report) {
  if (!goal) throw ContractError("goal", "none", "one that was set");
  const int number = ++progress.steps;
  if (state != NavigationState::moving) {
    NavigationDecision stopped{.step = number, .state = state};
    if (place.node) stopped.nearest = graph().view(*place.node);
    return stopped;
  }
  const std::uint64_t bytes_before = views.bytes_read();
  if (pilot.drives()) pilot.track(report.line, report.moved);
  Step step{
      view,
      report,
      SeenView(view, scales.full_scale, needs_all_components() ? 0 : scales.coarse_components),
      {.step = number},
      std::nullopt};
  decide(step);
  NavigationDecision& decision = step.decision;
  decision.state = state;
  if (state != NavigationState::moving) decision.advance_m = 0.0;
  decision.nearest = graph().view(*place.node);
  decision.area = *views.area();
  decision.way = guide().way;
  decision.components = step.view.components;
  decision.bytes_read = views.bytes_read() - bytes_before;
  // An observation that entered an area has loaded enough.
  const bool entered =
      std::ranges::find(decision.events, NavigationEvent::entered_area) != decision.events.end();
  if (state == NavigationState::moving && !entered) load_ahead();
  return std::move(decision);
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
std::size_t Navigator::loaded_views() const noexcept {
  return core_->views.size();
}

}  // namespace panonav
