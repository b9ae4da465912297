#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "panonav/navigation/known_route.hpp"

namespace panonav {

/// A part of a route that a planned path goes along.
struct RouteStretch {
  double from_m = 0.0;   ///< along the route
  double to_m = 0.0;     ///< likewise; less than `from_m`: against the direction of its recording
  std::size_t last = 0;  ///< of the way's views the one at its end
  /// Way along the route from its beginning to its end, whichever direction it is driven in.
  [[nodiscard]] double length_m() const noexcept;
};

/// How far a path over views goes along a route in one direction, from one of the places `starts_m`
/// along it. The stretch ends at the last view on the route such that, between consecutive views of
/// the path, the route is at most 1.5 times as long as the straight line. The route may therefore
/// turn a right corner between two views (1.41), but makes no detour where the path goes straight.
/// Of several answers, the one that comes farthest on the path is taken, then the shortest. Empty
/// when no view lies ahead. Cost: O(starts * places of the way's views * lines).
[[nodiscard]] std::optional<RouteStretch> stretch_along(const KnownRoute& route,
                                                        std::span<const double> starts_m,
                                                        std::span<const ViewId> way);

}  // namespace panonav
