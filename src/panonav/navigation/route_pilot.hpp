#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <span>

#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/steering.hpp"
#include "panonav/navigation/known_route.hpp"

namespace panonav {

/// Drives legs along recorded routes, by horizon lines: where a planned way goes along a route, the
/// robot repeats this as it was recorded. Deterministic.
class RoutePilot {
 public:
  /// None to drive along.
  RoutePilot() = default;
  /// The routes must outlive *this.
  explicit RoutePilot(std::span<const KnownRoute> routes) : routes_(routes) {}

  [[nodiscard]] std::span<const KnownRoute> routes() const noexcept { return routes_; }
  /// Whether a leg is under way.
  [[nodiscard]] bool drives() const noexcept { return leg_.has_value(); }

  /// Begins a leg of at least `shortest_m` along the route that leads farthest on the way, which
  /// starts with the robot's place: where `line` says that the robot is on the route, no farther
  /// from that place than `shortest_m`. Not along a route that was given up. Returns whether it
  /// began. Throws ContractError on a line of another length than the route's. Cost: that of
  /// `stretch_along` for each route, and of a search where one leads far enough.
  bool begin(std::span<const ViewId> way, std::span<const float> line, double shortest_m);

  /// The next look of a leg: `moved` is how the robot moved since the look before, in the frame it
  /// had then. An empty line: none was taken; the motion tells. Throws ContractError as `begin`,
  /// and without a leg.
  void track(std::span<const float> line, const Pose2& moved);

  // Of the leg under way; undefined without one.
  /// Where to go, in the robot's frame; empty when the leg has come to its end.
  [[nodiscard]] const std::optional<Point2>& aim() const { return leg_->aim; }
  /// The reference to which it leads.
  [[nodiscard]] ViewId end() const { return leg_->end; }
  /// The reference beside which the robot is, as far as line and motion tell.
  [[nodiscard]] ViewId place() const;
  /// Looks one after the other that did not tell a place on the leg.
  [[nodiscard]] int unknown_looks() const { return leg_->unknown_looks; }

  /// Ends the leg, if there is one.
  void stop() noexcept { leg_.reset(); }
  /// Ends the leg; its route is not driven along any more until `forgive`.
  void give_up();
  void forgive() noexcept { given_up_.clear(); }

 private:
  struct Leg {
    std::size_t route;
    RouteStretch stretch;
    RouteTracker tracker;
    PathFollower follower;
    ViewId end;
    std::optional<Point2> aim;
    int unknown_looks = 0;
  };
  void take_aim();

  std::span<const KnownRoute> routes_;
  std::set<std::size_t> given_up_;
  std::optional<Leg> leg_;
};

}  // namespace panonav
