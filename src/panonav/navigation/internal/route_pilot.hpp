#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <span>

#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/path_follower.hpp"
#include "panonav/navigation/internal/route_stretch.hpp"
#include "panonav/navigation/known_route.hpp"

namespace panonav {

/// Drives legs along recorded routes by horizon scanlines: where a planned path goes along a route,
/// the robot repeats the route as it was recorded. Deterministic.
class RoutePilot {
 public:
  /// None to drive along.
  RoutePilot() = default;
  /// The routes must outlive *this.
  explicit RoutePilot(std::span<const KnownRoute> routes) : routes_(routes) {}

  [[nodiscard]] std::span<const KnownRoute> routes() const noexcept { return routes_; }
  /// Whether a leg is under way.
  [[nodiscard]] bool drives() const noexcept { return leg_.has_value(); }

  /// Begins a leg of at least `shortest_m` along the route that leads farthest along the path,
  /// which starts with the robot's place. `line` must show that the robot is on the route, no
  /// farther from that place than `shortest_m`. Routes that were rejected are not used. Returns
  /// whether a leg began. Throws ContractError on a line of another length than the route's. Cost:
  /// that of `stretch_along` for each route, and of a search where one leads far enough.
  bool begin(std::span<const ViewId> way, std::span<const float> line, double shortest_m);

  /// The next observation of a leg: `moved` is the robot's motion since the observation before, in
  /// the frame it had then. An empty line: none was taken, and the motion alone is used. Throws
  /// ContractError as `begin`, and without a leg.
  void track(std::span<const float> line, const Pose2& moved);

  // Of the leg under way; undefined without one.
  /// Where to go, in the robot's frame; empty when the leg has come to its end.
  [[nodiscard]] const std::optional<Point2>& aim() const { return leg_->aim; }
  /// The reference to which it leads.
  [[nodiscard]] ViewId end() const { return leg_->end; }
  /// The reference beside the robot according to line and motion.
  [[nodiscard]] ViewId place() const;
  /// Number of consecutive observations that gave no place on the leg.
  [[nodiscard]] int unknown_steps() const { return leg_->unknown_steps; }

  /// Ends the leg, if there is one.
  void stop() noexcept { leg_.reset(); }
  /// Ends the leg; its route is not used again until `forgive`.
  void give_up();
  void forgive() noexcept { rejected_.clear(); }

 private:
  struct Leg {
    std::size_t route;
    RouteStretch stretch;
    RouteTracker tracker;
    PathFollower follower;
    ViewId end;
    std::optional<Point2> aim;
    int unknown_steps = 0;
  };
  void take_aim();

  std::span<const KnownRoute> routes_;
  std::set<std::size_t> rejected_;
  std::optional<Leg> leg_;
};

}  // namespace panonav
