// Part of the navigator that measures progress towards the goal and reacts if there is none.

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

/// Directions in which an obstructed robot tries to pass, one after another, before the edge is
/// blocked: ahead, then 40 and 75 degrees to either side.
constexpr std::array<double, 5> detours_rad{0.0, 0.7, -0.7, 1.3, -1.3};
/// Distance in edges from an obstacle within which edges may cross it: its width (two typical
/// edges) and one more.
constexpr int max_obstacle_links = 3;
/// Number of last steps whose median is the typical reduction of path length by a step.
constexpr std::size_t max_path_reductions = 5;
/// Angle between successive search directions; multiples of the golden angle cover the circle
/// evenly for any number.
constexpr double golden_angle_rad = 2.39996322972865332;
/// Homing options for one step, which is so short that no large displacements are searched.
constexpr FourierHomingOptions short_displacement{.displacement_search = false};

}  // namespace

bool Progress::was_obstructed() const {
  return std::ranges::any_of(edge_attempts,
                             [](const auto& each) { return each.second.obstructed_steps > 0; });
}

// Blocks an edge that was tried without success. If something obstructed the robot, also blocks all
// edges that cross a bar half way along the edge. The bar is always two typical edges wide; a wider
// one would also block the sides of objects and whole rooms.
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
                                             std::max(half, scales.median_edge_length)},
                                            max_obstacle_links);
    blocked.insert(blocked.end(), crossed.begin(), crossed.end());
  }
  // If an edge blocked in an earlier attempt fails again, blocks all edges of earlier attempts
  // together.
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
  if (planner.blocked_edge_count() == 0) return;
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

// Moves the assumed place to the most similar one with a path to the goal, since the memory does
// not hold every link between neighbours. Limited to a few times in each attempt, as there may be
// no such place. Returns false without success.
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
    // The first observation after planning is not progress.
    if (std::isfinite(progress.min_path_length)) {
      attempts.clear();
      progress.steps_without_progress = 0;
    }
    progress.min_path_length = length;
  }
}

// Determines whether the last step was obstructed, and updates the position at which the robot last
// knew its place.
void Navigator::Core::detect_obstruction(Step& step) {
  obstruction.is_present = step.report.obstacle;
  if (last.direction_rad && last.view) {
    const HomeVector back = home_vector_unchecked(*last.view, step.view.view, short_displacement);
    // If the views before and after the step hardly differ, the robot did not move. This is not
    // tested while the robot follows a stored route: its steps may be short there, and the
    // scanlines of the route determine its position.
    obstruction.is_present |=
        !pilot.is_on_leg() && !back.has_direction() &&
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
  // Resets the known position only at a good match: from a poor match, a detour may lead to an
  // unknown place.
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

// Updates progress after the last step. Blocks an edge if all detours failed, or the most tried
// edge if there was no progress for too long.
void Navigator::Core::block_failed_edges(Step& step) {
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

// Returns the length of the edge ahead relative to the typical length; 0 if unknown.
double Navigator::Core::relative_length(const Guide& ahead) const {
  if (!ahead.is_reachable()) return 0.0;
  const NavigationGraph::Edge& edge = graph().edges()[ahead.edge];
  return edge.a_from_b ? edge.length / scales.median_edge_length : 0.0;
}

// Returns `edge_patience`, multiplied by the relative length on a long edge, along which there are
// no other views.
int Navigator::Core::max_steps_without_progress() const {
  double length = 0.0;
  if (*place.node != goal->node) {
    length = relative_length(plan.committed ? plan.committed->guide : guide());
  }
  return static_cast<int>(std::ceil(options.edge_patience * std::max(1.0, length)));
}

// Returns the angle added to the planned direction: to pass an obstacle, or to try other directions
// after steps without progress.
double Navigator::Core::detour_rad() const {
  if (obstruction.level >= 2) {
    return detours_rad[static_cast<std::size_t>(obstruction.level / 2) % detours_rad.size()];
  }
  if (plan.committed) return 0.0;
  const int search_step = progress.steps_without_progress - (max_steps_without_progress() + 1) / 2;
  return search_step <= 0 ? 0.0 : wrap_angle(golden_angle_rad * search_step);
}

}  // namespace panonav
