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
/// picture after picture, unlike noise. A direction (one of 72, 5 degrees wide) is unexplained
/// where at least half of its columns are off by more than three deviations of the noise. It is
/// reported once it, or the direction next to it one picture before, was unexplained in five
/// pictures one after the other.
class RouteChanges {
 public:
  /// The changes according to this picture and those before it. Cost: O(columns).
  std::vector<AzimuthRange> add(const RouteFix& fix);
  /// There was a picture without a fix: counting starts again.
  void reset() noexcept { pictures_.fill(0); }

 private:
  static constexpr std::size_t sectors = 72;
  std::array<int, sectors> pictures_{};  // by direction in the world: for how many unexplained
};

}  // namespace panonav
