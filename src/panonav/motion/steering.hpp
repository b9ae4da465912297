#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Proportional control of a robot with differential drive.
struct SteeringOptions {
  double turn_gain = 0.8;     ///< of the error of direction, turned in one step
  double max_turn_rad = 0.5;  ///< in one step
  double travel_gain = 0.8;   ///< of the way that is left, driven in one step
  double step_m = 0.05;       ///< driven in one step at most
  /// With a larger error of direction the robot turns on the spot. It then comes no nearer to
  /// obstacles beside its path than the path does.
  double on_spot_rad = 0.5;
  friend bool operator==(const SteeringOptions&, const SteeringOptions&) = default;
};
void visit_options(SteeringOptions& options, OptionVisitor& visitor);

/// The next step towards a goal, as an odometry step [Y03 section 5.2]. The robot turns by a share
/// of the error of direction and drives a share of the distance that is left. It drives less the
/// farther the goal is off to the side, and not at all beyond `on_spot_rad`. Throws OptionError.
[[nodiscard]] Pose2 steer_to(const Pose2& robot, Point2 goal, const SteeringOptions& options = {});

/// How closely `PathFollower` keeps to a path.
struct PathFollowerOptions {
  double look_ahead_m = 0.3;  ///< the robot steers to a place of the path at most so far ahead
  /// That place is so near that the straight line to it leaves the path by no more than this.
  /// Corners are not cut where there may be no room.
  double max_cut_m = 0.02;
  double arrived_m = 0.02;   ///< so near to the end of the path the robot has arrived
  SteeringOptions steering;  ///< how each step towards the place ahead is made
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
  [[nodiscard]] std::optional<Point2> next_aim(Point2 robot);
  /// The step there, as an odometry step; empty when it has arrived.
  [[nodiscard]] std::optional<Pose2> next_step(const Pose2& robot);

  /// Distance along the path to the robot's place.
  [[nodiscard]] double along_m() const noexcept { return along_m_; }
  /// The robot's place on the path.
  [[nodiscard]] Point2 place() const { return place_at(along_m_); }
  /// Length of the whole path, in metres.
  [[nodiscard]] double length_m() const noexcept { return way_m_.back(); }

 private:
  [[nodiscard]] Point2 place_at(double along_m) const;
  void advance(Point2 robot);
  [[nodiscard]] Point2 place_ahead() const;

  PathFollowerOptions options_;
  std::vector<Point2> path_;
  std::vector<double> way_m_;  // to each place
  double along_m_ = 0.0;
};

}  // namespace panonav
