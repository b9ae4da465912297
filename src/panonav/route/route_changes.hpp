#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/route/route_fit.hpp"

namespace panonav {

/// Finds changes of the scene since a route was recorded: directions that fits leave unexplained
/// image after image, unlike noise. A direction (one of 72, 5 degrees wide) is unexplained where at
/// least half of its columns are off by more than three standard deviations of the noise. It is
/// reported once it, or the direction next to it one image before, was unexplained in five
/// successive images nearest to different lines of the route: positions between two lines are
/// interpolated, and images from the same gap share its error.
class RouteChanges {
 public:
  /// Azimuths in the robot's frame, counter-clockwise from the first to the second.
  struct AzimuthRange {
    double from_rad = 0.0;  ///< in [-pi, pi)
    /// End of the range in [-pi, pi); below `from_rad` if the range includes straight behind.
    double to_rad = 0.0;
  };

  RouteChanges() = default;  ///< Without lines each image counts.
  /// `lines`: poses from which those of the route were taken.
  explicit RouteChanges(std::span<const Pose2> lines) : lines_(lines.begin(), lines.end()) {}

  /// Returns the changes by this image and those before it. Cost: O(columns + lines).
  std::vector<AzimuthRange> add(const RouteFix& fix);
  /// Starts counting again, after an image without a fix.
  void reset() noexcept {
    images_.fill(0);
    line_.reset();
  }

 private:
  static constexpr std::size_t sectors = 72;
  [[nodiscard]] bool is_at_new_line(Point2 position);

  std::array<int, sectors>
      images_{};  // by direction in the world: number of successive unexplained ones
  std::vector<Pose2> lines_;
  std::optional<std::size_t> line_;  // nearest to the last image
};

}  // namespace panonav
