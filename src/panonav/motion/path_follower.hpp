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
  /// Largest distance of the path from the straight line to the target, so that corners are not cut
  /// where there may be no room.
  double max_cut_m = 0.02;
  double arrived_m = 0.02;  ///< distance from the end of the path at which the robot has arrived
  friend bool operator==(const PathFollowerOptions&, const PathFollowerOptions&) = default;
};
void visit_options(PathFollowerOptions& options, OptionVisitor& visitor);

/// Repeats a path by pure pursuit: the target lies on it a little ahead of the robot. The more the
/// path bends, the nearer the target is, but never nearer than a third of the look-ahead. The
/// robot's position on the path only advances, so that a path may cross and overlap itself. To
/// drive a path back, reverse it.
class PathFollower {
 public:
  /// Throws OptionError, and ContractError on a path of fewer than two points or a number that is
  /// not finite.
  explicit PathFollower(std::span<const Point2> path, const PathFollowerOptions& options = {});

  /// Returns the point to which a robot at `robot` has to steer; nullopt when it has arrived. Cost:
  /// O(points of the path within twice the look-ahead, squared).
  [[nodiscard]] std::optional<Point2> next_target(Point2 robot);

  /// Distance along the path to the robot's position on it.
  [[nodiscard]] double along_m() const noexcept { return along_m_; }
  /// The robot's position on the path.
  [[nodiscard]] Point2 position() const { return position_at(along_m_); }
  /// Length of the whole path, in metres.
  [[nodiscard]] double length_m() const noexcept { return length_to_m_.back(); }

 private:
  [[nodiscard]] Point2 position_at(double along_m) const;
  void advance_to_nearest(Point2 robot);
  [[nodiscard]] Point2 find_target() const;

  PathFollowerOptions options_;
  std::vector<Point2> path_;
  std::vector<double> length_to_m_;  // to each point of the path
  double along_m_ = 0.0;
};

}  // namespace panonav
