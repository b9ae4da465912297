#include "panonav/navigation/internal/route_stretch.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/route/route_place.hpp"

namespace panonav {

namespace {

// Length of the route over the straight line between two views: a right corner has 1.41.
constexpr double max_winding = 1.5;

// From one place in one direction: 1 as recorded, -1 back.
std::optional<RouteStretch> follow_way(const KnownRoute& route, double start_m, double direction,
                                       std::span<const ViewId> way) {
  const auto path = route.tracker.lines().poses();
  std::optional<RouteStretch> found;
  double at_m = start_m;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const Point2 here = point_on_route(path, at_m);
    std::optional<double> next_m;
    for (const double along_m : route.along_m(way[i])) {
      const double ahead_m = direction * (along_m - at_m);
      if (ahead_m < 0.0 || (next_m && ahead_m >= direction * (*next_m - at_m))) continue;
      const double straight_m = distance(here, point_on_route(path, along_m));
      if (ahead_m <= max_winding * straight_m) next_m = along_m;
    }
    if (!next_m) continue;
    at_m = *next_m;
    found = {start_m, at_m, i};
  }
  return found;
}

}  // namespace

double RouteStretch::length_m() const noexcept {
  return std::abs(to_m - from_m);
}

std::optional<RouteStretch> stretch_along(const KnownRoute& route, std::span<const double> starts_m,
                                          std::span<const ViewId> way) {
  std::optional<RouteStretch> best;
  for (const double start_m : starts_m) {
    for (const double direction : {1.0, -1.0}) {
      const auto found = follow_way(route, start_m, direction, way);
      if (!found) continue;
      const bool better = !best || found->last > best->last ||
                          (found->last == best->last && found->length_m() < best->length_m());
      if (better) best = found;
    }
  }
  return best;
}

}  // namespace panonav
