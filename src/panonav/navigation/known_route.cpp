#include "panonav/navigation/known_route.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/route/route_position.hpp"

namespace panonav {

void visit_options(KnownRouteOptions& options, OptionVisitor& visitor) {
  using T = KnownRouteOptions;
  constexpr OptionTable table{
      option<&T::max_lateral_m>("largest distance of a view or robot from the route", above(0),
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

KnownRoute make_known_route(const RoutePanorama& route, std::span<const KnownRoute::View> views,
                            const KnownRouteOptions& options,
                            const std::optional<RouteLimits>& learnt) {
  validate(options);
  KnownRoute known{
      RouteTracker(route, options.tracker, options.fit, learnt), {}, options.max_lateral_m};
  for (const KnownRoute::View& placed : views) {
    if (!std::isfinite(placed.pose.x_m) || !std::isfinite(placed.pose.y_m)) {
      throw ContractError("place of view " + std::to_string(placed.view.value), "not finite",
                          "finite numbers");
    }
    KnownRoute::Reference reference{placed.view, {}};
    for (const RoutePosition& pass :
         find_passes(route.poses(), placed.pose.position(), options.max_lateral_m)) {
      reference.along_m.push_back(pass.along_m);
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

}  // namespace panonav
