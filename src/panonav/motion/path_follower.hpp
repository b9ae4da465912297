#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Tolerances of `PathFollower`.
struct PathFollowerOptions {
  double look_ahead_m = 0.3;  ///< longest distance along the path to the target
  /// Largest distance between the path and the straight line to the target; limits how far corners
  /// are cut.
  double max_cut_m = 0.02;
  double arrived_m = 0.02;  ///< distance from the end of the path at which the robot has arrived
  friend bool operator==(const PathFollowerOptions&, const PathFollowerOptions&) = default;
};
void visit_options(PathFollowerOptions& options, OptionVisitor& visitor);

/// Follows a path by pure pursuit, that is, steers to a target on the path ahead of the robot. In
/// bends the target is nearer, but at least a third of the look-ahead distance away. The robot's
/// position on the path only advances, so that a path may cross or overlap itself. To drive a path
/// backwards, reverse the list of points.
class PathFollower {
 public:
  /// Throws OptionError, and ContractError on a path of fewer than two points or a number that is
  /// not finite.
  explicit PathFollower(std::span<const Point2> path, const PathFollowerOptions& options = {});

  /// Updates the position on the path and returns the point to which a robot at `robot` should
  /// steer; nullopt if it has arrived. Cost: O(points of the path within twice the look-ahead,
  /// squared).
  [[nodiscard]] std::optional<Point2> next_target(Point2 robot);

  /// Path length from the start to the robot's position on the path.
  [[nodiscard]] double along_m() const noexcept { return along_m_; }
  /// The robot's position on the path.
  [[nodiscard]] Point2 position() const { return position_at(along_m_); }
  /// Length of the whole path, in metres.
  [[nodiscard]] double length_m() const noexcept { return path_length_to_point_m_.back(); }

 private:
  [[nodiscard]] Point2 position_at(double along_m) const;
  void advance_to_nearest(Point2 robot);
  [[nodiscard]] Point2 find_target() const;

  PathFollowerOptions options_;
  std::vector<Point2> path_;
  std::vector<double> path_length_to_point_m_;  // to each point of the path
  double along_m_ = 0.0;
};

}  // namespace panonav
