#include "panonav/navigation/internal/route_pilot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/route/route_place.hpp"

namespace panonav {

bool RoutePilot::begin(std::span<const ViewId> way, std::span<const float> line,
                       double shortest_m) {
  stop();
  if (way.empty()) return false;
  std::optional<RouteStretch> planned;
  std::size_t chosen = 0;
  for (std::size_t i = 0; i < routes_.size(); ++i) {
    if (rejected_.contains(i)) continue;
    const auto found = stretch_along(routes_[i], routes_[i].along_m(way.front()), way);
    if (!found || found->length_m() < shortest_m) continue;
    if (planned && found->last <= planned->last) continue;
    planned = found;
    chosen = i;
  }
  if (!planned) return false;
  const KnownRoute& route = routes_[chosen];
  const auto fix = route.tracker.search(line);
  if (!fix) return false;
  // Line and view must agree on the place, which the route may pass several times.
  const auto path = route.tracker.lines().poses();
  std::vector<double> starts_m;
  for (const RoutePosition& place : find_passes(path, fix->pose.position(), route.beside_m)) {
    const auto agrees = [&](double along_m) {
      return std::abs(along_m - place.along_m) <= shortest_m;
    };
    if (std::ranges::any_of(route.along_m(way.front()), agrees)) starts_m.push_back(place.along_m);
  }
  const auto stretch = stretch_along(route, starts_m, way);
  if (!stretch || stretch->length_m() < shortest_m) return false;
  leg_.emplace(Leg{chosen,
                   *stretch,
                   route.tracker,
                   PathFollower(route_segment(path, stretch->from_m, stretch->to_m)),
                   way[stretch->last],
                   {},
                   0});
  leg_->tracker.set_pose(fix->pose);
  take_aim();
  return true;
}

void RoutePilot::track(std::span<const float> line, const Pose2& moved) {
  if (!leg_) throw ContractError("leg", "none", "one under way");
  RouteTracker& tracker = leg_->tracker;
  bool known = false;
  if (line.empty()) {
    tracker.set_pose(*tracker.pose() * moved);
  } else {
    known = tracker.track(line, moved).has_value();
  }
  take_aim();
  // A place of the route that is not on the leg is of no use.
  known &= distance(tracker.pose()->position(), leg_->follower.position()) <=
           routes_[leg_->route].beside_m;
  leg_->unknown_steps = known ? 0 : leg_->unknown_steps + 1;
}

ViewId RoutePilot::place() const {
  const RouteStretch& stretch = leg_->stretch;
  const double driven_m = leg_->follower.along_m();
  const double along_m = stretch.from_m + (stretch.to_m < stretch.from_m ? -driven_m : driven_m);
  const auto off_m = [&](const KnownRoute::Reference& reference) {
    double min_m = std::numeric_limits<double>::infinity();
    for (const double there_m : reference.along_m) {
      min_m = std::min(min_m, std::abs(there_m - along_m));
    }
    return min_m;
  };
  return std::ranges::min_element(routes_[leg_->route].references, {}, off_m)->view;
}

void RoutePilot::take_aim() {
  const Pose2 route_from_robot = *leg_->tracker.pose();
  leg_->aim = leg_->follower.next_target(route_from_robot.position());
  if (leg_->aim) leg_->aim = inverse(route_from_robot) * *leg_->aim;
}

void RoutePilot::give_up() {
  if (leg_) rejected_.insert(leg_->route);
  stop();
}

}  // namespace panonav
