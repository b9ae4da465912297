#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/route/route_fit.hpp"

namespace panonav {

/// Finds what has changed since a route was remembered: directions that fits leave unexplained
/// picture after picture, unlike noise. A direction (one of 72, 5 degrees wide) is unexplained
/// where at least half of its columns are off by more than three deviations of the noise. It is
/// reported once it, or the direction next to it one picture before, was unexplained in five
/// pictures one after the other that are nearest to different lines of the route: what lies between
/// two lines is interpolated, and pictures from the same gap all share its error.
class RouteChanges {
 public:
  /// Azimuths in the robot's frame, counter-clockwise from the first to the second.
  struct AzimuthRange {
    double from_rad = 0.0;  ///< in [-pi, pi)
    /// In [-pi, pi); below `from_rad` where the range goes through straight behind.
    double to_rad = 0.0;
  };

  RouteChanges() = default;  ///< Without lines each picture counts.
  /// `lines`: where those of the route were seen from.
  explicit RouteChanges(std::span<const Pose2> lines) : lines_(lines.begin(), lines.end()) {}

  /// The changes according to this picture and those before it. Cost: O(columns
  /// + lines).
  std::vector<AzimuthRange> add(const RouteFix& fix);
  /// There was a picture without a fix: counting starts again.
  void reset() noexcept {
    pictures_.fill(0);
    line_.reset();
  }

 private:
  static constexpr std::size_t sectors = 72;
  [[nodiscard]] bool counts(Point2 position);

  std::array<int, sectors> pictures_{};  // by direction in the world: for how many unexplained
  std::vector<Pose2> lines_;
  std::optional<std::size_t> line_;  // nearest to the picture that counted last
};

}  // namespace panonav
