#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// How closely `PathFollower` keeps to a path.
struct PathFollowerOptions {
  double look_ahead_m = 0.3;  ///< the robot steers to a place of the path at most so far ahead
  /// That place is so near that the straight line to it leaves the path by no more than this.
  /// Corners are not cut where there may be no room.
  double max_cut_m = 0.02;
  double arrived_m = 0.02;  ///< so near to the end of the path the robot has arrived
  friend bool operator==(const PathFollowerOptions&, const PathFollowerOptions&) = default;
};
void visit_options(PathFollowerOptions& options, OptionVisitor& visitor);

/// Repeats a path: steers to a place on it a little ahead of the robot (pure pursuit). The more the
/// path bends, the nearer that place is, but it is never nearer than a third of the look-ahead. The
/// robot's place moves on along the path from step to step, so that a path may cross and overlap
/// itself. To drive a path back, give it in reverse.
class PathFollower {
 public:
  /// Throws OptionError, and ContractError on a path of fewer than two places or a number that is
  /// not finite.
  explicit PathFollower(std::span<const Point2> path, const PathFollowerOptions& options = {});

  /// Where a robot that is at `robot` has to steer to; empty when it has arrived. Cost: O(places of
  /// the path within twice the look-ahead, squared).
  [[nodiscard]] std::optional<Point2> next_target(Point2 robot);

  /// Distance along the path to the robot's place.
  [[nodiscard]] double along_m() const noexcept { return along_m_; }
  /// The robot's place on the path.
  [[nodiscard]] Point2 position() const { return position_at(along_m_); }
  /// Length of the whole path, in metres.
  [[nodiscard]] double length_m() const noexcept { return length_to_m_.back(); }

 private:
  [[nodiscard]] Point2 position_at(double along_m) const;
  void advance(Point2 robot);
  [[nodiscard]] Point2 find_target() const;

  PathFollowerOptions options_;
  std::vector<Point2> path_;
  std::vector<double> length_to_m_;  // to each place
  double along_m_ = 0.0;
};

}  // namespace panonav
