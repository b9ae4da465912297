#include "panonav/navigation/known_route.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/route/route_place.hpp"

namespace panonav {

namespace {

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

void visit_options(KnownRouteOptions& options, OptionVisitor& visitor) {
  using T = KnownRouteOptions;
  constexpr OptionTable table{
      option<&T::beside_m>("largest distance of references and robots beside a route", above(0),
                           100),
      options_of<&T::tracker>(),
      options_of<&T::fit>(),
  };
  table.visit(options, visitor);
}

std::span<const double> KnownRoute::along_m(ViewId view) const {
  const auto found = std::ranges::lower_bound(references, view, {}, &Reference::view);
  if (found == references.end() || found->view != view) return {};
  return found->along_m;
}

KnownRoute known_route(const RoutePanorama& route, std::span<const RouteView> views,
                       const KnownRouteOptions& options) {
  validate(options);
  KnownRoute known{RouteTracker(route, options.tracker, options.fit), {}, options.beside_m};
  for (const RouteView& placed : views) {
    if (!std::isfinite(placed.pose.x_m) || !std::isfinite(placed.pose.y_m)) {
      throw ContractError("place of view " + std::to_string(placed.view.value), "not finite",
                          "finite numbers");
    }
    KnownRoute::Reference reference{placed.view, {}};
    for (const RoutePlace& place :
         places_on_route(route.poses(), placed.pose.position(), options.beside_m)) {
      reference.along_m.push_back(place.along_m);
    }
    if (!reference.along_m.empty()) known.references.push_back(std::move(reference));
  }
  std::ranges::sort(known.references, {}, &KnownRoute::Reference::view);
  const auto twice = std::ranges::adjacent_find(known.references, {}, &KnownRoute::Reference::view);
  if (twice != known.references.end()) {
    throw ContractError("view " + std::to_string(twice->view.value), "placed twice",
                        "one place each");
  }
  return known;
}

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
