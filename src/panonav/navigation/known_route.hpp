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

struct KnownRouteOptions {
  /// References and robots lie no farther beside the route. A search tries places up to 0.5 m
  /// beside it; a robot at a reference may be a little farther off than that.
  double beside_m = 0.4;
  RouteTrackerOptions tracker;
  RouteFitOptions fit;
};
void visit_options(KnownRouteOptions& options, OptionVisitor& visitor);

/// A reference view, and where it was taken in a route's frame.
struct RouteView {
  ViewId view;
  Pose2 pose;
};

/// A recorded route of which the memory knows some places: so plans over the memory may lead along
/// it. Made by `known_route`; cost of a copy: that of the tracker.
struct KnownRoute {
  struct Reference {
    ViewId view;
    /// Ways along the route to where it passes the view, ascending: one for each time.
    std::vector<double> along_m;
    friend bool operator==(const Reference&, const Reference&) = default;
  };
  RouteTracker tracker;
  std::vector<Reference> references;  ///< on the route, ascending by view
  double beside_m = 0.0;

  /// Where the view lies along the route; empty when it does not.
  [[nodiscard]] std::span<const double> along_m(ViewId view) const;
};

/// Joins a route and references by their poses: whoever recorded both on one drive has them in one
/// frame. References out of reach are left out. Throws ContractError on a route of fewer than two
/// lines, a pose that is not finite or a view that comes twice; OptionError. Cost: that of a
/// `RouteTracker`, and views times lines.
[[nodiscard]] KnownRoute known_route(const RoutePanorama& route, std::span<const RouteView> views,
                                     const KnownRouteOptions& options = {});

/// A part of a route that a planned way goes along.
struct RouteStretch {
  double from_m = 0.0;   ///< along the route
  double to_m = 0.0;     ///< likewise; less than `from_m`: against the direction of its recording
  std::size_t last = 0;  ///< of the way's views the one at its end
  [[nodiscard]] double length_m() const noexcept;
};

/// How far a way over views goes along a route in one direction, from one of the places `starts_m`
/// along it: to the last view that lies on the route where this is, from one such view of the way
/// to the next, at most 1.5 times as long as straight. So the route may turn a right corner between
/// two views (1.41), but does not go round where the way goes across. Of several answers the one
/// that comes farthest on the way, then the shortest. Empty when no view lies ahead. Cost:
/// O(starts * places of the way's views * lines).
[[nodiscard]] std::optional<RouteStretch> stretch_along(const KnownRoute& route,
                                                        std::span<const double> starts_m,
                                                        std::span<const ViewId> way);

}  // namespace panonav
