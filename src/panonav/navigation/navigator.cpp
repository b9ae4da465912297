#include "panonav/navigation/navigator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/navigation/internal/navigator_place.hpp"
#include "panonav/navigation/obstacle.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

namespace {

// A vector of less confidence is as likely as not but the error of reading it.
constexpr double least_confidence = 0.5;
// The next reference as the robot sees it now counts where it does not contradict the field.
constexpr double most_correction_rad = std::numbers::pi / 3.0;
// How a robot that is obstructed tries to get past: so many times before the way counts as blocked.
constexpr std::array<double, 5> detours_rad{0.0, 0.7, -0.7, 1.3, -1.3};
// A search step that is turned aside by more says nothing about the passage ahead.
constexpr double most_aside_rad = 1.0;
// Passages that cross a bar lie within so many of its place.
constexpr int links_across = 3;

// A passage so much longer than usual is held to until its end. `step_m` is half a usual passage.
constexpr double least_long = 2.0;
constexpr double steps_of_passage = 2.0;
// So many of the last steps tell how far one leads.
constexpr std::size_t steps_kept = 5;
// Fewer tell no home vector.
constexpr int least_components = 3;

// Its multiples cover the circle evenly, however many there are.
constexpr double golden_angle_rad = 2.39996322972865332;
// A step is short, so there is no need to search far displacements.
constexpr FourierHomingOptions short_way{.displacement_search = false};

}  // namespace

Navigator::Navigator(const ViewSource& source, AreaPlanner planner, const NavigatorOptions& options)
    : source_(&source),
      planner_(std::move(planner)),
      options_(options),
      // The next place and what is looked at there are at hand on both sides of a border.
      views_(source, options.near_links + 1) {
  validate(options_);
  require(planner_.graph().size() > 0, "views of the graph", 0.0, ">= 1");
  const ViewId first = planner_.graph().view(0);
  const VisualMemory one = source.load({&first, 1});
  full_scale_ = one.full_scale();
  components_ = one.shape().components;
  const int coarse = options_.coarse_components;
  require(coarse == 0 || coarse >= least_components, "coarse_components", coarse,
          "0, or 3 or more");
  if (coarse < components_) coarse_components_ = coarse;
  scale_ = learn_place_scale(source, planner_.graph());
  coarse_scale_ = coarse_components_ == 0
                      ? scale_
                      : learn_place_scale(source, planner_.graph(), coarse_components_);
  std::vector<double> lengths;
  for (const Passage& passage : planner_.graph().passages()) lengths.push_back(passage.length);
  if (!lengths.empty()) typical_length_ = upper_median(std::move(lengths));
  narrow_ = narrow_places(planner_.graph(), planner_.areas(), options_.near_links);
}

void Navigator::set_goal(ViewId goal) {
  if (planner_.closed() > 0) planner_.open_all();
  planner_.set_goal(goal);
  goal_ = planner_.graph().node_of(goal);
  const auto around = nodes_around(planner_.graph(), {&*goal_, 1}, options_.near_links);
  around_goal_ = {around.begin(), around.end()};
  arrival_ = learn_arrival_scale(*source_, planner_.graph(), goal);
  goal_view_ = homing_view(source_->load({&goal, 1}).signature(goal));
  homing_.reset();
  pilot_.stop();
  pilot_.forgive();
  last_view_.reset();
  commanded_rad_.reset();
  elsewhere_.reset();
  aimed_for_.reset();
  tries_.clear();
  suspects_.clear();
  obstructed_ = false;
  looks_in_vain_ = 0;
  closed_here_ = false;
  state_ = NavigationState::moving;
  looks_ = unknown_looks_ = elsewhere_looks_ = obstruction_ = attempts_ = ways_sought_ = 0;
  plan_fields();
}

void Navigator::forget_place() {
  known_node_.reset();
  node_.reset();
  homing_.reset();
  pilot_.stop();
  last_view_.reset();
  commanded_rad_.reset();
  known_at_.reset();
  under_way_.reset();
}

// The robot is not where it was taken for: what it held to there does not lead on.
void Navigator::forget_plans(NavigationDecision& decision) {
  homing_.reset();
  under_way_.reset();
  if (pilot_.drives()) decision.events.push_back(NavigationEvent::route_left);
  pilot_.stop();
}

// The field of the loaded area, and progress, start anew.
void Navigator::plan_fields() {
  if (views_.area()) field_ = planner_.field(*views_.area());
  under_way_.reset();
  least_way_ = std::numeric_limits<double>::infinity();
}

const Guide& Navigator::guide() const {
  return field_.at(planner_.areas().place_of[*node_]);
}

// Closes a passage that was tried in vain, and all that cross a bar half way along it where
// something stood in the way. The bar is two usual passages wide, whatever was closed before: wider
// ones shut the sides of things and rooms as a whole.
void Navigator::close_way(std::size_t passage, NavigationDecision& decision) {
  const NavigationGraph& graph = planner_.graph();
  const Tries tried = tries_.at(passage);
  std::vector<std::size_t> shut{passage};
  const auto motion = graph.motion_from(tried.node, passage);
  const bool is_wide = tried.obstructed > 1 || closed_here_ || !suspects_.empty();
  if (is_wide && motion && (motion->x_m != 0.0 || motion->y_m != 0.0)) {
    const double half = 0.5 * std::hypot(motion->x_m, motion->y_m);
    const auto across = passages_across(
        graph,
        {tried.node, std::atan2(motion->y_m, motion->x_m), half, std::max(half, typical_length_)},
        links_across);
    shut.insert(shut.end(), across.begin(), across.end());
  }
  // What was closed before and is no better now is closed as a whole.
  if (std::ranges::any_of(shut, [&](std::size_t p) { return suspects_.contains(p); })) {
    shut.insert(shut.end(), suspects_.begin(), suspects_.end());
  }
  planner_.close(shut);
  decision.events.push_back(NavigationEvent::closed);
  obstruction_ = looks_in_vain_ = 0;
  closed_here_ = true;
  around_closed_ = nodes_around(graph, {&tried.node, 1}, 2 * options_.near_links);
  tries_.clear();
  plan_fields();
}

// Opens what is closed, so often; then the run ends.
void Navigator::try_again(NavigationDecision& decision, NavigationState otherwise) {
  ++attempts_;
  if (attempts_ >= options_.attempts) {
    state_ = otherwise;
    return;
  }
  homing_.reset();
  if (planner_.closed() == 0) return;
  for (std::size_t passage = 0; passage < planner_.graph().passages().size(); ++passage) {
    if (planner_.is_closed(passage)) suspects_.insert(passage);
  }
  planner_.open_all();
  tries_.clear();
  looks_in_vain_ = ways_sought_ = 0;
  closed_here_ = false;
  decision.events.push_back(NavigationEvent::reopened);
  plan_fields();
}

// From a place without a way the robot goes on as if it were at the most alike one that has a way:
// the memory does not hold every way between neighbours. Not for ever, as there may be none.
bool Navigator::find_way_from_here(const Seen& seen, NavigationDecision& decision) {
  if (ways_sought_ >= options_.agreeing_looks) return false;
  ++ways_sought_;
  const SubAreas& areas = planner_.areas();
  std::vector<std::uint8_t> has_way(planner_.graph().size());
  for (std::size_t area = 0; area < areas.nodes.size(); ++area) {
    const std::vector<Guide> field = planner_.field(area);
    for (std::size_t place = 0; place < field.size(); ++place) {
      has_way[areas.nodes[area][place]] = static_cast<std::uint8_t>(field[place].reachable());
    }
  }
  const auto found = search_everywhere(*source_, planner_.graph(), areas, seen.signature,
                                       [&](std::size_t node) { return has_way[node] != 0; });
  decision.events.push_back(NavigationEvent::relocalised);
  if (!found || found->difference > scale_.limit()) return false;
  decision.difference = found->difference;
  forget_plans(decision);
  enter(found->node, decision);
  return true;
}

// What became of the step before, and whether the robot comes nearer to the goal.
void Navigator::count_try() {
  if (way_before_ && !obstructed_ && guide().way < *way_before_) {
    if (ways_of_steps_.size() == steps_kept) ways_of_steps_.erase(ways_of_steps_.begin());
    ways_of_steps_.push_back(*way_before_ - guide().way);
  }
  if (!std::ranges::binary_search(around_closed_, *node_)) closed_here_ = false;
  const auto tried = aimed_for_ ? tries_.find(*aimed_for_) : tries_.end();
  if (tried != tries_.end()) tried->second.obstructed += static_cast<int>(obstructed_);
  ++looks_in_vain_;
  if (guide().way < least_way_) {
    // The first look of a plan is no progress.
    if (std::isfinite(least_way_)) {
      tries_.clear();
      looks_in_vain_ = 0;
    }
    least_way_ = guide().way;
  }
}

void Navigator::notice_obstacles(const Seen& seen, const RobotReport& report,
                                 NavigationDecision& decision) {
  obstructed_ = report.obstacle;
  heading_for_rad_.reset();
  if (commanded_rad_ && last_view_) {
    const HomeVector back = home_vector_unchecked(*last_view_, seen.view.view, short_way);
    // The robot stood. Along a route steps may be short, and lines tell the place.
    obstructed_ |= !pilot_.drives() && back.confidence < least_confidence &&
                   image_difference(*last_view_, seen.view.view) <
                       0.5 * std::min(scale_.neighbours, coarse_scale_.neighbours);
    heading_for_rad_ = wrap_angle(*commanded_rad_ + back.heading_rad);
    if (known_at_) {
      const double way_m = obstructed_ ? 0.0 : commanded_m_;
      const Pose2 step{way_m * std::cos(*commanded_rad_), way_m * std::sin(*commanded_rad_),
                       -back.heading_rad};
      known_at_ = inverse(step) * *known_at_;
    }
  }
  // Where the place is hardly known, a step aside may be an unknown one.
  const bool well_known = unknown_looks_ == 0 && decision.difference <= 0.5 * limit(seen.view);
  if (well_known || (unknown_looks_ == 0 && !known_at_)) known_at_ = Point2{};
  if (obstructed_) {
    obstruction_ += 2;
    under_way_.reset();
    decision.events.push_back(NavigationEvent::obstructed);
  } else if (obstruction_ > 0) {
    --obstruction_;
  }
  if (homing_) return;
  count_try();
  if (pilot_.drives() || tries_.empty() || !guide().reachable()) return;
  const auto most_obstructed =
      std::ranges::max_element(tries_, {}, [](const auto& t) { return t.second.obstructed; });
  if (most_obstructed->second.obstructed >= static_cast<int>(detours_rad.size())) {
    close_way(most_obstructed->first, decision);
  } else if (looks_in_vain_ > patience()) {
    close_way(
        std::ranges::max_element(tries_, {}, [](const auto& t) { return t.second.looks; })->first,
        decision);
  }
}

// Of the passage ahead over that of a usual one; 0 where nothing tells.
double Navigator::relative_length(const Guide& ahead) const {
  if (!ahead.reachable()) return 0.0;
  const Passage& passage = planner_.graph().passages()[ahead.passage];
  return passage.a_from_b ? passage.length / typical_length_ : 0.0;
}

// A robot along a passage has come to no other view yet, so a long one takes more looks.
int Navigator::patience() const {
  double length = 0.0;
  if (*node_ != *goal_) length = relative_length(under_way_ ? under_way_->guide : guide());
  return static_cast<int>(std::ceil(options_.passage_patience * std::max(1.0, length)));
}

// Along a long passage the robot goes on for its end, whatever reference is nearest meanwhile;
// along any other when it has come back to where that begins though nothing stood in the way: then
// a reference beside it has sent it back.
void Navigator::begin_long_way() {
  const double length = relative_length(guide());
  const bool is_free =
      std::ranges::none_of(tries_, [](const auto& t) { return t.second.obstructed > 0; });
  const bool came_back = looks_in_vain_ >= options_.agreeing_looks && is_free &&
                         guide().way <= least_way_ && length > 0.0;
  if (under_way_ || (length < least_long && !came_back)) return;
  const double steps = steps_of_passage * std::max(1.0, length);
  under_way_ = {*node_, guide(), static_cast<int>(std::ceil(steps))};
}

// By how much the direction is turned: to get past what is in the way, or, where a direction turned
// out to lead nowhere, to search around.
double Navigator::detour_rad() const {
  if (obstruction_ >= 2) {
    return detours_rad[static_cast<std::size_t>(obstruction_ / 2) % detours_rad.size()];
  }
  if (under_way_) return 0.0;
  const int searching = looks_in_vain_ - (patience() + 1) / 2;
  return searching <= 0 ? 0.0 : wrap_angle(golden_angle_rad * searching);
}

void Navigator::go_home(const Seen& seen, NavigationDecision& decision) {
  if (!homing_) {
    HomingPursuitOptions homing = options_.homing;
    homing.longest_step_m = std::min(homing.longest_step_m, options_.step_m);
    homing.arrived_difference = arrival_.difference;
    // Well inside: the vector has an error of its own.
    homing.stop_length = 0.25 * arrival_.length;
    homing_.emplace(*goal_view_, homing);
    decision.events.push_back(NavigationEvent::homing);
  }
  const PursuitDecision step = homing_->decide(seen.view.view);
  decision.homing = true;
  decision.difference = step.difference;
  decision.next = planner_.graph().view(*goal_);
  decision.direction_rad = step.turn_rad;
  decision.advance_m = step.advance_m;
  const bool obstructed = obstruction_ >= 2 * options_.agreeing_looks;
  if (step.state == PursuitState::moving && !obstructed) return;
  // Homing may stop for other reasons than a short vector; the place decides. Noise and new things
  // in view make a difference, too: a robot that sees no way left is there when the place may be
  // this one.
  const double length = step.vector.length();
  if ((step.difference <= arrival_.difference && length <= arrival_.length) ||
      (step.difference <= std::max(2.0 * arrival_.difference, scale_.limit()) &&
       length <= 0.5 * arrival_.length)) {
    state_ = NavigationState::arrived;
    return;
  }
  decision.events.push_back(NavigationEvent::homing_failed);
  homing_.reset();
  obstruction_ = 0;
  try_again(decision, obstructed ? NavigationState::blocked : NavigationState::lost);
}

// The direction of where the robot still knew its place: the way back of its own steps, as
// something near may hide what the reference there shows; else as the reference is seen from here.
std::optional<double> Navigator::way_back_rad(const SeenView& view) {
  if (known_at_ && std::hypot(known_at_->x_m, known_at_->y_m) >= 0.5 * options_.step_m) {
    return std::atan2(known_at_->y_m, known_at_->x_m);
  }
  const HomeVector back =
      home_vector(views_.view(planner_.graph().view(*known_node_), view.components), view.view);
  if (back.confidence <= least_confidence) return std::nullopt;
  return back.direction_rad();
}

// From an unknown place to where the robot still knew its own, if something tells where that is.
bool Navigator::go_back(const Seen& seen, NavigationDecision& decision) {
  if (!known_node_ || obstructed_) return false;
  const ViewId known = planner_.graph().view(*known_node_);
  if (!views_.holds(known)) return false;
  const auto direction_rad = way_back_rad(seen.view);
  if (!direction_rad) return false;
  const SubAreas& areas = planner_.areas();
  if (unknown_looks_ == options_.agreeing_looks && areas.area_of[*known_node_] == views_.area()) {
    // Something hides the place that should come next, as what stands in the way does.
    const Guide& ahead = field_.at(areas.place_of[*known_node_]);
    if (ahead.reachable() && ahead.next != *known_node_) {
      Tries& tries = tries_.try_emplace(ahead.passage, Tries{*known_node_, 0, 0}).first->second;
      ++tries.looks;
      tries.obstructed += 2;
    }
  }
  decision.next = known;
  decision.direction_rad = *direction_rad;
  decision.advance_m = options_.step_m;
  commanded_rad_ = decision.direction_rad;
  return true;
}

// The goal, or another reference from which the goal is too near for a direction, as views of
// several drives may be from one place, or for a step, which would lead beyond it.
bool Navigator::is_at_goal() const {
  if (*node_ == *goal_) return true;
  // The first steps of homing try how far one leads.
  if (homing_ && around_goal_.contains(*node_)) return true;
  if (!ways_of_steps_.empty() && around_goal_.contains(*node_) &&
      guide().way <= 0.5 * upper_median(ways_of_steps_)) {
    return true;
  }
  if (guide().next != *goal_) return false;
  const auto motion = planner_.graph().motion_from(*node_, guide().passage);
  return motion && std::hypot(motion->x_m, motion->y_m) <= 0.5 * typical_length_;
}

void Navigator::follow(const Seen& seen, NavigationDecision& decision) {
  const NavigationGraph& graph = planner_.graph();
  if (unknown_looks_ > 0 && go_back(seen, decision)) return;
  begin_long_way();
  const std::size_t from = under_way_ ? under_way_->from : *node_;
  const Guide ahead = under_way_ ? under_way_->guide : guide();
  decision.next = graph.view(ahead.next);
  // The direction of the reference in the frame of the robot, which is turned against it.
  std::optional<double> direction;
  std::optional<CompassReading> turned;
  if (views_.holds(graph.view(from))) turned = views_.turn_against(graph.view(from), seen.view);
  if (ahead.direction_rad && turned) {
    direction = wrap_angle(*ahead.direction_rad - turned->heading_rad);
  }
  if (views_.holds(*decision.next)) {
    const HomeVector next =
        home_vector(views_.view(*decision.next, seen.view.components), seen.view.view);
    if (next.confidence > least_confidence) {
      const double seen_rad = next.direction_rad();
      const std::optional<double> known = direction || obstructed_ ? direction : heading_for_rad_;
      const double off = known ? angle_difference(seen_rad, *known) : 0.0;
      if (std::abs(off) < most_correction_rad) direction = seen_rad - 0.5 * off;
    }
  }
  // Where no view tells the direction, the robot goes on as it went.
  if (!direction) direction = obstructed_ ? 0.0 : heading_for_rad_.value_or(0.0);
  double detour = detour_rad();
  if (obstructed_ && unknown_looks_ > 0 && heading_for_rad_) {
    // What hides the place is left behind to see where this is.
    direction = heading_for_rad_;
    detour = std::numbers::pi;
  }
  decision.direction_rad = wrap_angle(*direction + detour);
  decision.advance_m = options_.step_m;
  commanded_rad_ = decision.direction_rad;
  Tries& tries = tries_.try_emplace(ahead.passage, Tries{from, 0, 0}).first->second;
  ++tries.looks;
  if (obstruction_ >= 2 || std::abs(detour) < most_aside_rad) aimed_for_ = ahead.passage;
}

// A leg along a route, where views leave no doubt of the place and nothing was in the way so far:
// what shut a passage may shut the route, too.
void Navigator::begin_leg(const RobotReport& report, NavigationDecision& decision) {
  if (pilot_.routes().empty() || report.line.empty() || obstructed_ || unknown_looks_ > 0 ||
      elsewhere_looks_ > 0 || planner_.closed() > 0) {
    return;
  }
  const NavigationGraph& graph = planner_.graph();
  std::vector<ViewId> way;
  for (const std::size_t node : planner_.planned_way(*node_)) way.push_back(graph.view(node));
  if (!pilot_.begin(way, report.line, options_.shortest_leg_m)) return;
  under_way_.reset();
  decision.events.push_back(NavigationEvent::route);
}

// Repeats a recorded route; false where there is none to go along, or none any more.
bool Navigator::go_along_route(const RobotReport& report, NavigationDecision& decision) {
  if (!pilot_.drives()) {
    begin_leg(report, decision);
  } else if (pilot_.unknown_looks() >= options_.agreeing_looks ||
             obstruction_ >= 2 * options_.agreeing_looks || looks_in_vain_ > patience()) {
    pilot_.give_up();
    decision.events.push_back(NavigationEvent::route_left);
    // The way by views has not been tried here.
    tries_.clear();
    obstruction_ = looks_in_vain_ = 0;
  }
  if (!pilot_.drives()) return false;
  const auto aim = pilot_.aim();
  if (!aim) {
    pilot_.stop();
    return false;
  }
  decision.on_route = true;
  decision.next = pilot_.end();
  decision.direction_rad = std::atan2(aim->y_m, aim->x_m);
  // The straight way there is near the route; odometry errs by little over a usual step.
  decision.advance_m = std::min(options_.step_m, std::hypot(aim->x_m, aim->y_m));
  commanded_rad_ = decision.direction_rad;
  return true;
}

NavigationDecision Navigator::look(const FourierSignature& view, const RobotReport& report) {
  if (!goal_) throw ContractError("goal", "none", "one that was set");
  NavigationDecision decision;
  decision.look = ++looks_;
  decision.state = state_;
  if (state_ != NavigationState::moving) {
    if (node_) decision.nearest = planner_.graph().view(*node_);
    return decision;
  }
  const std::uint64_t bytes_before = views_.bytes_read();
  if (pilot_.drives()) pilot_.track(report.line, report.moved);
  Seen seen{view, SeenView(view, full_scale_, needs_all_components() ? 0 : coarse_components_)};
  locate(seen, report, decision);
  if (state_ == NavigationState::moving) notice_obstacles(seen, report, decision);
  if (state_ == NavigationState::moving && !guide().reachable() &&
      !find_way_from_here(seen, decision)) {
    try_again(decision, NavigationState::unreachable);
    // Nothing was closed that could be opened.
    if (!guide().reachable()) state_ = NavigationState::unreachable;
  }
  commanded_rad_.reset();
  aimed_for_.reset();
  // At an unknown place the robot waits for the looks to agree; then it goes by the best guess.
  const bool waits = unknown_looks_ > 0 && unknown_looks_ < options_.agreeing_looks && !obstructed_;
  if (state_ == NavigationState::moving && !waits) {
    if (is_at_goal()) {
      pilot_.stop();
      go_home(seen, decision);
    } else {
      homing_.reset();
      if (!go_along_route(report, decision)) follow(seen, decision);
    }
  }
  if (state_ == NavigationState::moving && looks_ >= options_.most_looks) {
    state_ = NavigationState::blocked;
  }
  last_view_ = seen.view.view;
  commanded_m_ = decision.advance_m;
  way_before_.reset();
  if (commanded_m_ == options_.step_m && !homing_) way_before_ = guide().way;
  decision.state = state_;
  if (state_ != NavigationState::moving) decision.advance_m = 0.0;
  decision.nearest = planner_.graph().view(*node_);
  decision.area = *views_.area();
  decision.way = guide().way;
  decision.components = seen.view.components;
  decision.bytes_read = views_.bytes_read() - bytes_before;
  // A look that entered an area has loaded enough.
  const bool entered =
      std::ranges::find(decision.events, NavigationEvent::entered_area) != decision.events.end();
  if (state_ == NavigationState::moving && !entered) load_ahead();
  return decision;
}

}  // namespace panonav
