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

/// Which references count as lying on a route, and how a robot is followed along it.
struct KnownRouteOptions {
  /// Largest lateral offset of references and robots from the route. A search tries positions up to
  /// 0.5 m beside it; a robot at a reference may be a little farther off than that reference.
  double max_lateral_m = 0.4;
  RouteTrackerOptions tracker;  ///< of the robot on the route
  RouteFitOptions fit;          ///< of its scanlines
};
void visit_options(KnownRouteOptions& options, OptionVisitor& visitor);

/// A recorded route and the references of the memory along it, so that plans over the memory can
/// follow it. Made by `make_known_route`; a copy costs as much as one of the tracker.
struct KnownRoute {
  /// A reference view and its pose in the route's frame.
  struct View {
    ViewId view;  ///< an id of the memory
    Pose2 pose;   ///< in the route's frame
  };
  /// A view along the route.
  struct Reference {
    ViewId view;                  ///< an id of the memory
    std::vector<double> along_m;  ///< distances along the route at which it passes, ascending
    friend bool operator==(const Reference&, const Reference&) = default;
  };
  RouteTracker tracker;               ///< holds the route; copied for each run along it
  std::vector<Reference> references;  ///< on the route, ascending by view
  double max_lateral_m = 0.0;         ///< as in the options

  /// Returns the distances along the route at which it passes the view; none when it does not.
  [[nodiscard]] std::span<const double> along_m(ViewId view) const;
};

/// Joins a route and references by their poses, which are in one frame when both were recorded on
/// one drive. References out of reach are left out. Throws ContractError on a route of fewer than
/// two lines, a pose that is not finite or a view that comes twice; OptionError. Cost: that of a
/// `RouteTracker`, and views times lines.
[[nodiscard]] KnownRoute make_known_route(const RoutePanorama& route,
                                          std::span<const KnownRoute::View> views,
                                          const KnownRouteOptions& options = {});

}  // namespace panonav
