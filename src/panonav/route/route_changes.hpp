#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/route/route_fit.hpp"

namespace panonav {

/// Finds changes of the scene since a route was recorded: directions that fits leave unexplained
/// image after image, unlike noise. A direction (one of 72, 5 degrees wide) is unexplained if at
/// least half of its columns are off by more than three standard deviations of the noise. It is
/// reported after five successive images in which it was unexplained; one image earlier an adjacent
/// direction is enough. Only images nearest to a new line of the route are counted, as lines are
/// interpolated in between, and images from the same gap share the error of interpolation.
class RouteChanges {
 public:
  /// Azimuths in the robot's frame, counter-clockwise from the first to the second.
  struct AzimuthRange {
    double from_rad = 0.0;  ///< in [-pi, pi)
    /// End of the range in [-pi, pi); below `from_rad` if the range includes straight behind.
    double to_rad = 0.0;
  };

  RouteChanges() = default;  ///< Without lines every image is counted.
  /// `lines`: poses from which the lines of the route were taken.
  explicit RouteChanges(std::span<const Pose2> lines) : lines_(lines.begin(), lines.end()) {}

  /// Adds the fix of the next image and returns the changes that are now confirmed. Cost: O(columns
  /// + lines).
  std::vector<AzimuthRange> add(const RouteFix& fix);
  /// Starts counting again, after an image without a fix.
  void reset() noexcept {
    unexplained_images_.fill(0);
    nearest_line_.reset();
  }

 private:
  static constexpr std::size_t sectors = 72;
  [[nodiscard]] bool update_nearest_line(Point2 position);

  std::array<int, sectors>
      unexplained_images_{};  // by direction in the world: number of successive unexplained ones
  std::vector<Pose2> lines_;
  std::optional<std::size_t> nearest_line_;  // nearest to the last image
};

}  // namespace panonav
