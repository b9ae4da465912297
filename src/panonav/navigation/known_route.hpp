#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/route/route_tracker.hpp"

namespace panonav {

/// Options of a known route: which references lie on it, and how a robot follows it.
struct KnownRouteOptions {
  /// Largest lateral offset of references and robots from the route. The robot may be a little
  /// farther away than the reference it is at; the route tracker searches offsets up to 0.5 m.
  double max_lateral_m = 0.4;
  RouteTrackerOptions tracker;  ///< options of tracking the robot on the route
  RouteFitOptions fit;          ///< options of fitting its scanlines to the route
};
void visit_options(KnownRouteOptions& options, OptionVisitor& visitor);

/// A recorded route and the memory's references along it, so that planned paths can follow it. Made
/// by `make_known_route`; a copy costs as much as copying the tracker.
struct KnownRoute {
  /// A reference view and its pose in the route's frame.
  struct View {
    ViewId view;  ///< an id of the memory
    Pose2 pose;   ///< in the route's frame
  };
  /// A view along the route.
  struct Reference {
    ViewId view;                  ///< an id of the memory
    std::vector<double> along_m;  ///< distances along the route of its passages, ascending
    friend bool operator==(const Reference&, const Reference&) = default;
  };
  RouteTracker tracker;               ///< holds the route; copied for each run along it
  std::vector<Reference> references;  ///< on the route, ascending by view
  double max_lateral_m = 0.0;         ///< as in the options

  /// Returns the distances along the route at which it passes the view; empty if it does not pass.
  [[nodiscard]] std::span<const double> along_m(ViewId view) const;
};

/// Assigns references to a route by their poses in the route's frame (the same as in the memory if
/// both were recorded in one drive). Leaves out references farther than `max_lateral_m` from the
/// route. Throws ContractError on a route of fewer than two lines, a pose that is not finite or a
/// view that comes twice; OptionError. `learnt`: as for a `RouteTracker`. Cost: that of a
/// `RouteTracker`, and views times lines.
[[nodiscard]] KnownRoute make_known_route(const RoutePanorama& route,
                                          std::span<const KnownRoute::View> views,
                                          const KnownRouteOptions& options = {},
                                          const std::optional<RouteLimits>& learnt = std::nullopt);

}  // namespace panonav
