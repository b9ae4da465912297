// Whether a navigator comes nearer to its goal, and what hinders it.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/geometry/angles.hpp"
#include "panonav/navigation/internal/navigator_core.hpp"
#include "panonav/navigation/internal/obstacle.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

namespace {

// A vector of less confidence is as likely as not but the error of reading it.
constexpr double min_way_back_confidence = 0.5;
// How a robot that is obstructed tries to get past: so many times before the way counts as blocked.
constexpr std::array<double, 5> detours_rad{0.0, 0.7, -0.7, 1.3, -1.3};
// Edges that cross a bar lie within so many of its place.
constexpr int links_across = 3;
// So many of the last steps tell how far one leads.
constexpr std::size_t steps_kept = 5;
// Its multiples cover the circle evenly, however many there are.
constexpr double golden_angle_rad = 2.39996322972865332;
// A step is short, so there is no need to search far displacements.
constexpr FourierHomingOptions short_way{.displacement_search = false};

}  // namespace

bool Progress::was_obstructed() const {
  return std::ranges::any_of(tries, [](const auto& t) { return t.second.obstructed > 0; });
}

// Closes an edge that was tried in vain, and all that cross a bar half way along it where
// something stood in the way. The bar is two usual edges wide, whatever was closed before: wider
// ones shut the sides of things and rooms as a whole.
void Navigator::Core::close_way(std::size_t edge, Step& step) {
  const EdgeTries tried = progress.tries.at(edge);
  std::vector<std::size_t> shut{edge};
  const auto motion = graph().motion_from(tried.node, edge);
  const bool is_wide = tried.obstructed > 1 || progress.closed_here || !progress.suspects.empty();
  if (is_wide && motion && (motion->x_m != 0.0 || motion->y_m != 0.0)) {
    const double half = 0.5 * std::hypot(motion->x_m, motion->y_m);
    const auto across = edges_across(graph(),
                                     {tried.node, std::atan2(motion->y_m, motion->x_m), half,
                                      std::max(half, scales.typical_length)},
                                     links_across);
    shut.insert(shut.end(), across.begin(), across.end());
  }
  // What was closed before and is no better now is closed as a whole.
  if (std::ranges::any_of(shut, [&](std::size_t e) { return progress.suspects.contains(e); })) {
    shut.insert(shut.end(), progress.suspects.begin(), progress.suspects.end());
  }
  planner.close(shut);
  step.note(NavigationEvent::closed);
  obstruction.level = progress.steps_in_vain = 0;
  progress.closed_here = true;
  progress.around_closed = nodes_around(graph(), {&tried.node, 1}, 2 * options.near_links);
  progress.tries.clear();
  plan_anew();
}

// Opens what is closed, so often; then the run ends.
void Navigator::Core::try_again(Step& step, NavigationState otherwise) {
  if (++progress.attempts >= options.attempts) {
    state = otherwise;
    return;
  }
  homing.reset();
  if (planner.closed() == 0) return;
  for (std::size_t edge = 0; edge < graph().edges().size(); ++edge) {
    if (planner.is_blocked(edge)) progress.suspects.insert(edge);
  }
  planner.unblock_all();
  progress.tries.clear();
  progress.steps_in_vain = progress.ways_sought = 0;
  progress.closed_here = false;
  step.note(NavigationEvent::reopened);
  plan_anew();
}

// From a place without a way the robot goes on as if it were at the most similar one that has a
// way: the memory does not hold every way between neighbours. Not for ever, as there may be none.
bool Navigator::Core::find_way_from_here(Step& step) {
  if (progress.ways_sought >= options.min_agreeing_steps) return false;
  ++progress.ways_sought;
  const SubAreas& areas = planner.areas();
  std::vector<std::uint8_t> has_way(graph().size());
  for (std::size_t area = 0; area < areas.nodes.size(); ++area) {
    const std::vector<Guide> field = planner.field(area);
    for (std::size_t i = 0; i < field.size(); ++i) {
      has_way[areas.nodes[area][i]] = static_cast<std::uint8_t>(field[i].reachable());
    }
  }
  const auto found = search_whole_memory(*source, graph(), areas, step.signature,
                                         [&](std::size_t node) { return has_way[node] != 0; });
  step.note(NavigationEvent::relocalised);
  if (!found || found->difference > scales.place.limit()) return false;
  step.decision.difference = found->difference;
  forget_plans(step);
  enter(found->node, step);
  return true;
}

// What became of the step before, and whether the robot comes nearer to the goal.
void Navigator::Core::count_try() {
  const double way = guide().way;
  if (last.way && !obstruction.now && way < *last.way) {
    if (step_ways.size() == steps_kept) step_ways.erase(step_ways.begin());
    step_ways.push_back(*last.way - way);
  }
  if (!std::ranges::binary_search(progress.around_closed, *place.node)) {
    progress.closed_here = false;
  }
  const auto tried = last.aimed_for ? progress.tries.find(*last.aimed_for) : progress.tries.end();
  if (tried != progress.tries.end()) tried->second.obstructed += static_cast<int>(obstruction.now);
  ++progress.steps_in_vain;
  if (way < progress.min_way) {
    // The first observation of a plan is no progress.
    if (std::isfinite(progress.min_way)) {
      progress.tries.clear();
      progress.steps_in_vain = 0;
    }
    progress.min_way = way;
  }
}

void Navigator::Core::notice_obstacles(Step& step) {
  obstruction.now = step.report.obstacle;
  if (last.direction_rad && last.view) {
    const HomeVector back = home_vector_unchecked(*last.view, step.view.view, short_way);
    // The robot stood. Along a route steps may be short, and lines tell the place.
    obstruction.now |= !pilot.drives() && back.confidence < min_way_back_confidence &&
                       image_difference(*last.view, step.view.view) <
                           0.5 * std::min(scales.place.neighbours, scales.coarse.neighbours);
    step.heading_for_rad = wrap_angle(*last.direction_rad + back.heading_rad);
    if (place.known_at) {
      const double way_m = obstruction.now ? 0.0 : last.advance_m;
      const Pose2 moved{way_m * std::cos(*last.direction_rad),
                        way_m * std::sin(*last.direction_rad), -back.heading_rad};
      place.known_at = inverse(moved) * *place.known_at;
    }
  }
  // Where the place is hardly known, a step aside may be an unknown one.
  const bool is_known = place.doubt.unknown_steps == 0;
  const bool well_known = is_known && step.decision.difference <= 0.5 * scales.limit(step.view);
  if (well_known || (is_known && !place.known_at)) place.known_at = Point2{};
  if (obstruction.now) {
    obstruction.level += 2;
    plan.under_way.reset();
    step.note(NavigationEvent::obstructed);
  } else if (obstruction.level > 0) {
    --obstruction.level;
  }
  if (homing) return;
  count_try();
  if (pilot.drives() || progress.tries.empty() || !guide().reachable()) return;
  const auto most_obstructed = std::ranges::max_element(
      progress.tries, {}, [](const auto& t) { return t.second.obstructed; });
  if (most_obstructed->second.obstructed >= static_cast<int>(detours_rad.size())) {
    close_way(most_obstructed->first, step);
  } else if (progress.steps_in_vain > patience()) {
    const auto most_tried =
        std::ranges::max_element(progress.tries, {}, [](const auto& t) { return t.second.steps; });
    close_way(most_tried->first, step);
  }
}

// Of the edge ahead over that of a usual one; 0 where nothing tells.
double Navigator::Core::relative_length(const Guide& ahead) const {
  if (!ahead.reachable()) return 0.0;
  const NavigationGraph::Edge& edge = graph().edges()[ahead.edge];
  return edge.a_from_b ? edge.length / scales.typical_length : 0.0;
}

// A robot along an edge has come to no other view yet, so a long one takes more steps.
int Navigator::Core::patience() const {
  double length = 0.0;
  if (*place.node != goal->node) {
    length = relative_length(plan.under_way ? plan.under_way->guide : guide());
  }
  return static_cast<int>(std::ceil(options.edge_patience * std::max(1.0, length)));
}

// By how much the direction is turned: to get past what is in the way, or, where a direction turned
// out to lead nowhere, to search around.
double Navigator::Core::detour_rad() const {
  if (obstruction.level >= 2) {
    return detours_rad[static_cast<std::size_t>(obstruction.level / 2) % detours_rad.size()];
  }
  if (plan.under_way) return 0.0;
  const int searching = progress.steps_in_vain - (patience() + 1) / 2;
  return searching <= 0 ? 0.0 : wrap_angle(golden_angle_rad * searching);
}

}  // namespace panonav
