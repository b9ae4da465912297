#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "panonav/route/route_fit.hpp"

namespace panonav {

/// Azimuths in the robot's frame, counter-clockwise from the first to the second.
struct AzimuthRange {
  double from_rad = 0.0;
  double to_rad = 0.0;
};

/// Finds what has changed since a route was remembered: directions that fits leave unexplained
/// picture after picture. Noise leaves something here and there, a thing that was moved stays where
/// it is. A direction (one of 72, 5 degrees wide) counts where at least half of its columns are off
/// by more than three deviations of the noise, which is what a fit takes for usual itself; it is
/// named once it has counted in five pictures one after the other, or the direction next to it,
/// where the thing was one picture before.
class RouteChanges {
 public:
  /// What has changed as far as this picture and those before it tell. Cost: O(columns).
  std::vector<AzimuthRange> add(const RouteFix& fix);
  /// There was a picture without a fix: all begins anew.
  void reset() noexcept { pictures_.fill(0); }

 private:
  static constexpr std::size_t sectors = 72;
  std::array<int, sectors> pictures_{};  // by direction in the world: for how many unexplained
};

}  // namespace panonav
