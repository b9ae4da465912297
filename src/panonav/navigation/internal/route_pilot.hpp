#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <span>

#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/path_follower.hpp"
#include "panonav/navigation/known_route.hpp"

namespace panonav {

/// A section of a route that a planned path follows.
struct RouteSection {
  double from_m = 0.0;   ///< along the route
  double to_m = 0.0;     ///< along the route; if less than `from_m`, opposite to its recording
  std::size_t last = 0;  ///< index in the path of the view at the end of the section
  /// Path length of the section, in either direction.
  [[nodiscard]] double length_m() const noexcept;
};

/// Finds how far a path over views follows a route in one direction, from one of the positions
/// `starts_m` along it. The section ends at the last view on the route for which, between
/// successive views of the path, the route is at most 1.5 times as long as the straight line. So
/// the route may turn a right-angled corner between two views (1.41), but not make a detour.
/// Returns the section that leads farthest along the path, of ties the shortest; nullopt if no view
/// is ahead. Cost: O(starts * passages of the path's views * lines).
[[nodiscard]] std::optional<RouteSection> find_section(const KnownRoute& route,
                                                       std::span<const double> starts_m,
                                                       std::span<const ViewId> path);

/// Drives legs along recorded routes by horizon scanlines: if a planned path follows a route, the
/// robot repeats the recorded route. Deterministic.
class RoutePilot {
 public:
  /// Has no routes.
  RoutePilot() = default;
  /// The routes must outlive *this.
  explicit RoutePilot(std::span<const KnownRoute> routes) : routes_(routes) {}

  [[nodiscard]] std::span<const KnownRoute> routes() const noexcept { return routes_; }
  /// True while a leg is under way.
  [[nodiscard]] bool is_on_leg() const noexcept { return leg_.has_value(); }

  /// Begins a leg of at least `min_length_m` along the route that leads farthest along the path,
  /// which starts at the robot's place. `line` must show that the robot is on the route, at most
  /// `min_length_m` from that place. Does not use abandoned routes. Returns false if no leg began.
  /// Throws ContractError on a line of another length than the route's. Cost: that of
  /// `find_section` for each route, and of a search if one route leads far enough.
  bool begin_leg(std::span<const ViewId> path, std::span<const float> line, double min_length_m);

  /// Updates the position on the leg by the next observation. `moved`: the robot's motion since the
  /// last observation, in its frame at that time; used alone if `line` is empty. Throws
  /// ContractError like `begin_leg`, and without a leg.
  void track(std::span<const float> line, const Pose2& moved);

  // Undefined without a leg.
  /// The point to drive to, in the robot's frame; nullopt at the end of the leg.
  [[nodiscard]] const std::optional<Point2>& target() const { return leg_->target; }
  /// The reference at the end of the leg.
  [[nodiscard]] ViewId end() const { return leg_->end; }
  /// The reference nearest to the robot along the route.
  [[nodiscard]] ViewId nearest_reference() const;
  /// Number of successive observations for which no position on the leg was found.
  [[nodiscard]] int unknown_steps() const { return leg_->unknown_steps; }

  /// Ends the leg, if there is one.
  void end_leg() noexcept { leg_.reset(); }
  /// Ends the leg and excludes its route until `allow_all_routes`.
  void abandon_leg();
  void allow_all_routes() noexcept { abandoned_routes_.clear(); }

 private:
  struct Leg {
    std::size_t route;
    RouteSection section;
    RouteTracker tracker;
    PathFollower follower;
    ViewId end;
    std::optional<Point2> target;
    int unknown_steps = 0;
  };
  void update_target();

  std::span<const KnownRoute> routes_;
  std::set<std::size_t> abandoned_routes_;
  std::optional<Leg> leg_;
};

}  // namespace panonav
