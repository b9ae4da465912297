#include "panonav/navigation/internal/route_pilot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/route/route_position.hpp"

namespace panonav {

namespace {

/// Largest ratio of the route's length to the straight line between two views; a right-angled
/// corner has 1.41.
constexpr double max_detour_ratio = 1.5;

// Finds how far the path follows the route from one position in one direction: 1 as recorded, -1
// backwards.
std::optional<RouteSection> find_followed_section(const KnownRoute& route, double start_m,
                                                  double direction, std::span<const ViewId> path) {
  const auto poses = route.tracker.lines().poses();
  std::optional<RouteSection> found;
  double at_m = start_m;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Point2 here = point_on_route(poses, at_m);
    std::optional<double> next_m;
    for (const double along_m : route.along_m(path[i])) {
      const double ahead_m = direction * (along_m - at_m);
      if (ahead_m < 0.0 || (next_m && ahead_m >= direction * (*next_m - at_m))) continue;
      const double straight_m = distance(here, point_on_route(poses, along_m));
      if (ahead_m <= max_detour_ratio * straight_m) next_m = along_m;
    }
    if (!next_m) continue;
    at_m = *next_m;
    found = {start_m, at_m, i};
  }
  return found;
}

}  // namespace

double RouteSection::length_m() const noexcept {
  return std::abs(to_m - from_m);
}

std::optional<RouteSection> find_section(const KnownRoute& route, std::span<const double> starts_m,
                                         std::span<const ViewId> path) {
  std::optional<RouteSection> best;
  for (const double start_m : starts_m) {
    for (const double direction : {1.0, -1.0}) {
      const auto found = find_followed_section(route, start_m, direction, path);
      if (!found) continue;
      const bool is_better = !best || found->last > best->last ||
                             (found->last == best->last && found->length_m() < best->length_m());
      if (is_better) best = found;
    }
  }
  return best;
}

bool RoutePilot::begin_leg(std::span<const ViewId> path, std::span<const float> line,
                           double min_length_m) {
  end_leg();
  if (path.empty()) return false;
  std::optional<RouteSection> planned;
  std::size_t chosen = 0;
  for (std::size_t i = 0; i < routes_.size(); ++i) {
    if (abandoned_routes_.contains(i)) continue;
    const auto found = find_section(routes_[i], routes_[i].along_m(path.front()), path);
    if (!found || found->length_m() < min_length_m) continue;
    if (planned && found->last <= planned->last) continue;
    planned = found;
    chosen = i;
  }
  if (!planned) return false;
  const KnownRoute& route = routes_[chosen];
  const auto fix = route.tracker.search(line);
  if (!fix) return false;
  // Scanline and view must agree on the position, because the route may pass the view several
  // times.
  const auto poses = route.tracker.lines().poses();
  std::vector<double> starts_m;
  for (const RoutePosition& start : find_passes(poses, fix->pose.position(), route.max_lateral_m)) {
    const auto agrees = [&](double along_m) {
      return std::abs(along_m - start.along_m) <= min_length_m;
    };
    if (std::ranges::any_of(route.along_m(path.front()), agrees)) starts_m.push_back(start.along_m);
  }
  const auto section = find_section(route, starts_m, path);
  if (!section || section->length_m() < min_length_m) return false;
  leg_.emplace(Leg{chosen,
                   *section,
                   route.tracker,
                   PathFollower(route_segment(poses, section->from_m, section->to_m)),
                   path[section->last],
                   {}});
  leg_->tracker.set_pose(fix->pose);
  update_target();
  return true;
}

void RoutePilot::track(std::span<const float> line, const Pose2& moved) {
  if (!leg_) throw ContractError("leg", "none", "one under way");
  RouteTracker& tracker = leg_->tracker;
  bool is_known = false;
  if (line.empty()) {
    tracker.set_pose(*tracker.pose() * moved);
  } else {
    is_known = tracker.track(line, moved).has_value();
  }
  update_target();
  // A position on the route, but not on the leg, does not count as known.
  is_known &= distance(tracker.pose()->position(), leg_->follower.position()) <=
              routes_[leg_->route].max_lateral_m;
  leg_->unknown_steps = is_known ? 0 : leg_->unknown_steps + 1;
}

ViewId RoutePilot::nearest_reference() const {
  const RouteSection& section = leg_->section;
  const double driven_m = leg_->follower.along_m();
  const double along_m = section.from_m + (section.to_m < section.from_m ? -driven_m : driven_m);
  const auto distance_m = [&](const KnownRoute::Reference& reference) {
    double min_m = std::numeric_limits<double>::infinity();
    for (const double there_m : reference.along_m) {
      min_m = std::min(min_m, std::abs(there_m - along_m));
    }
    return min_m;
  };
  return std::ranges::min_element(routes_[leg_->route].references, {}, distance_m)->view;
}

void RoutePilot::update_target() {
  const Pose2 route_from_robot = *leg_->tracker.pose();
  leg_->target = leg_->follower.next_target(route_from_robot.position());
  if (leg_->target) leg_->target = inverse(route_from_robot) * *leg_->target;
}

void RoutePilot::abandon_leg() {
  if (leg_) abandoned_routes_.insert(leg_->route);
  end_leg();
}

}  // namespace panonav
