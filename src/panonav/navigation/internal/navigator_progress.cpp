// Progress of a navigator towards its goal, and its reaction if there is none.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/geometry/angles.hpp"
#include "panonav/navigation/internal/navigator_core.hpp"
#include "panonav/navigation/internal/obstacle.hpp"

namespace panonav {

namespace {

/// Directions in which an obstructed robot tries to pass, one after the other, before the edge
/// counts as blocked: ahead, then 40 and 75 degrees to either side.
constexpr std::array<double, 5> detours_rad{0.0, 0.7, -0.7, 1.3, -1.3};
/// Links from an obstacle within which edges may cross it: twice its half width and one more.
constexpr int obstacle_links = 3;
/// The last steps whose median says how far one leads.
constexpr std::size_t max_path_reductions = 5;
/// Multiples of the golden angle cover the circle evenly, however many there are.
constexpr double golden_angle_rad = 2.39996322972865332;
/// A step is short, so no far displacement need be searched.
constexpr FourierHomingOptions short_displacement{.displacement_search = false};

}  // namespace

bool Progress::was_obstructed() const {
  return std::ranges::any_of(edge_attempts,
                             [](const auto& each) { return each.second.obstructed_steps > 0; });
}

// Blocks an edge that was tried without success and, where something obstructed the robot, all that
// cross a bar half way along it. The bar is two typical edges wide, whatever was blocked before:
// wider ones would shut the sides of things and whole rooms.
void Navigator::Core::block_edge(std::size_t edge, Step& step) {
  const EdgeAttempts tried = progress.edge_attempts.at(edge);
  std::vector<std::size_t> blocked{edge};
  const auto motion = graph().motion_from(tried.node, edge);
  const bool is_wide = tried.obstructed_steps > 1 || !progress.near_blocked_edge.empty() ||
                       !progress.suspect_edges.empty();
  if (is_wide && motion && (motion->x_m != 0.0 || motion->y_m != 0.0)) {
    const double half = 0.5 * std::hypot(motion->x_m, motion->y_m);
    const auto crossed = find_crossed_edges(graph(),
                                            {tried.node, std::atan2(motion->y_m, motion->x_m), half,
                                             std::max(half, scales.typical_length)},
                                            obstacle_links);
    blocked.insert(blocked.end(), crossed.begin(), crossed.end());
  }
  // Edges that were blocked in an earlier attempt, and one of which fails again, are blocked as
  // one.
  const auto is_suspect = [&](std::size_t e) { return progress.suspect_edges.contains(e); };
  if (std::ranges::any_of(blocked, is_suspect)) {
    blocked.insert(blocked.end(), progress.suspect_edges.begin(), progress.suspect_edges.end());
  }
  planner.block(blocked);
  step.add_event(NavigationDecision::Event::closed);
  obstruction.level = progress.steps_without_progress = 0;
  progress.near_blocked_edge = nodes_around(graph(), {&tried.node, 1}, 2 * options.near_links);
  progress.edge_attempts.clear();
  replan();
}

// Begins another attempt with all edges unblocked, or ends the run after the last attempt.
void Navigator::Core::unblock_edges_or_end(Step& step, NavigationDecision::State end_state) {
  if (++progress.attempts >= options.attempts) {
    state = end_state;
    return;
  }
  homing.reset();
  if (planner.blocked_edges() == 0) return;
  for (std::size_t edge = 0; edge < graph().edges().size(); ++edge) {
    if (planner.is_blocked(edge)) progress.suspect_edges.insert(edge);
  }
  planner.unblock_all();
  progress.edge_attempts.clear();
  progress.steps_without_progress = progress.path_searches = 0;
  progress.near_blocked_edge.clear();
  step.add_event(NavigationDecision::Event::reopened);
  replan();
}

// Continues from the most similar place that has a path, as the memory does not hold every link
// between neighbours; some times in each attempt only, as there may be none.
bool Navigator::Core::relocalise_with_path(Step& step) {
  if (progress.path_searches >= options.min_agreeing_steps) return false;
  ++progress.path_searches;
  const SubAreas& areas = planner.areas();
  std::vector<std::uint8_t> has_path(graph().size());
  for (std::size_t area = 0; area < areas.nodes.size(); ++area) {
    const std::vector<Guide> field = planner.field(area);
    for (std::size_t i = 0; i < field.size(); ++i) {
      has_path[areas.nodes[area][i]] = static_cast<std::uint8_t>(field[i].is_reachable());
    }
  }
  const auto found = search_whole_memory(*source, graph(), areas, step.signature,
                                         [&](std::size_t node) { return has_path[node] != 0; });
  step.add_event(NavigationDecision::Event::relocalised);
  if (!found || found->difference > scales.place.max_difference()) return false;
  step.decision.difference = found->difference;
  abandon_plans(step);
  set_place(found->node, step);
  return true;
}

void Navigator::Core::update_path_length() {
  const double length = guide().path_length;
  if (last.path_length && !obstruction.is_present && length < *last.path_length) {
    if (path_reductions.size() == max_path_reductions) {
      path_reductions.erase(path_reductions.begin());
    }
    path_reductions.push_back(*last.path_length - length);
  }
  if (!std::ranges::binary_search(progress.near_blocked_edge, *place.node)) {
    progress.near_blocked_edge.clear();
  }
  auto& attempts = progress.edge_attempts;
  const auto tried = last.target_edge ? attempts.find(*last.target_edge) : attempts.end();
  if (tried != attempts.end()) {
    tried->second.obstructed_steps += static_cast<int>(obstruction.is_present);
  }
  ++progress.steps_without_progress;
  if (length < progress.min_path_length) {
    // The first observation of a plan is no progress.
    if (std::isfinite(progress.min_path_length)) {
      attempts.clear();
      progress.steps_without_progress = 0;
    }
    progress.min_path_length = length;
  }
}

// Sets whether the step before was obstructed, and where the robot last knew its place.
void Navigator::Core::detect_obstruction(Step& step) {
  obstruction.is_present = step.report.obstacle;
  if (last.direction_rad && last.view) {
    const HomeVector back = home_vector_unchecked(*last.view, step.view.view, short_displacement);
    // Views that hardly differ: the robot stood. Along a route steps may be short, and lines show
    // the place.
    obstruction.is_present |=
        !pilot.is_on_leg() && back.confidence < min_vector_confidence &&
        image_difference(*last.view, step.view.view) <
            0.5 * std::min(scales.place.neighbour_difference, scales.coarse.neighbour_difference);
    step.last_direction_rad = wrap_angle(*last.direction_rad + back.heading_rad);
    if (place.known_position_m) {
      const double length_m = obstruction.is_present ? 0.0 : last.advance_m;
      const Pose2 moved{length_m * std::cos(*last.direction_rad),
                        length_m * std::sin(*last.direction_rad), -back.heading_rad};
      place.known_position_m = inverse(moved) * *place.known_position_m;
    }
  }
  // If the place hardly matches, a detour may lead to an unknown one.
  const bool is_known = place.doubt.unknown_steps == 0;
  const bool is_well_known =
      is_known && step.decision.difference <= 0.5 * scales.max_difference(step.view);
  if (is_well_known || (is_known && !place.known_position_m)) place.known_position_m = Point2{};
  if (obstruction.is_present) {
    obstruction.level += 2;
    plan.committed.reset();
    step.add_event(NavigationDecision::Event::obstructed);
  } else if (obstruction.level > 0) {
    --obstruction.level;
  }
}

// Takes stock of the step before, and blocks the edge that was tried most where nothing helps.
void Navigator::Core::update_progress(Step& step) {
  detect_obstruction(step);
  if (homing) return;
  update_path_length();
  const auto& attempts = progress.edge_attempts;
  if (pilot.is_on_leg() || attempts.empty() || !guide().is_reachable()) return;
  const auto most_obstructed = std::ranges::max_element(
      attempts, {}, [](const auto& each) { return each.second.obstructed_steps; });
  if (most_obstructed->second.obstructed_steps >= static_cast<int>(detours_rad.size())) {
    block_edge(most_obstructed->first, step);
  } else if (progress.steps_without_progress > max_steps_without_progress()) {
    const auto most_tried =
        std::ranges::max_element(attempts, {}, [](const auto& each) { return each.second.steps; });
    block_edge(most_tried->first, step);
  }
}

// Returns the length of the edge ahead over the typical one; 0 where it is not known.
double Navigator::Core::relative_length(const Guide& ahead) const {
  if (!ahead.is_reachable()) return 0.0;
  const NavigationGraph::Edge& edge = graph().edges()[ahead.edge];
  return edge.a_from_b ? edge.length / scales.typical_length : 0.0;
}

// More along a long edge, on which a robot comes to no other view for a while.
int Navigator::Core::max_steps_without_progress() const {
  double length = 0.0;
  if (*place.node != goal->node) {
    length = relative_length(plan.committed ? plan.committed->guide : guide());
  }
  return static_cast<int>(std::ceil(options.edge_patience * std::max(1.0, length)));
}

// Returns the angle by which the direction is changed: to pass an obstacle, or to search around
// where steps in the planned direction brought no progress.
double Navigator::Core::detour_rad() const {
  if (obstruction.level >= 2) {
    return detours_rad[static_cast<std::size_t>(obstruction.level / 2) % detours_rad.size()];
  }
  if (plan.committed) return 0.0;
  const int search_step = progress.steps_without_progress - (max_steps_without_progress() + 1) / 2;
  return search_step <= 0 ? 0.0 : wrap_angle(golden_angle_rad * search_step);
}

}  // namespace panonav
