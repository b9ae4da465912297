#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav_simulation/free_space.hpp"

namespace panonav::simulation {

/// True if a robot touches nothing on the straight line, checked every `spacing_m` beyond `from`.
/// Borders of drivable areas are no obstacles.
[[nodiscard]] bool has_room_between(const FreeSpace& space, double robot_radius_m, Point2 from,
                                    Point2 to, double spacing_m);

/// Returns the distance from a place to the polyline through the poses; infinity for none.
[[nodiscard]] double distance_from_route_m(Point2 place, std::span<const Pose2> route);

/// A direction on the left (1) or the right (-1) of the intended one.
struct OpenDirection {
  double direction_rad = 0.0;
  int side = 0;
};
/// Finds the nearest open direction left and right of `direct_rad`, 15 degrees apart; on one side
/// only, unless `side` is 0. Nullopt if none is open.
[[nodiscard]] std::optional<OpenDirection> find_open_direction(
    double direct_rad, int feelers_each_side, int side,
    const std::function<bool(double direction_rad)>& is_open);

/// Behaviour of a robot in front of an obstacle.
enum class ObstacleRule {
  stop,  ///< it stops there, and the run ends
  /// Drives past obstacles: with feelers as long as the step, it tries directions left and right of
  /// the requested one, 15 degrees apart, up to 165 degrees off, nearest first, and takes the first
  /// in which half a step is free. While the requested direction stays blocked it keeps to the side
  /// that it has chosen, and changes the side where that one is blocked. If no direction is free,
  /// it stops.
  pass,
};

/// A robot base in a simulated place: executes commands with errors. Holds the true pose
/// and the random stream of its errors.
class SimulatedRobot {
 public:
  /// `space` must outlive the robot. Throws OptionError, and ContractError when `start` is not
  /// free.
  SimulatedRobot(const FreeSpace& space, const OdometryNoise& motion, ObstacleRule obstacles,
                 const Pose2& start, std::uint64_t seed);

  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }

  /// Finds the direction of a step of `advance_m` towards `direct_rad` past obstacles, in the robot
  /// frame; nullopt if it is stopped. Remembers the side on which it passes.
  [[nodiscard]] std::optional<double> find_free_direction(double direct_rad, double advance_m);

  /// Moves as far as nothing stands in the way. Returns true if that was the whole step.
  bool go(double direction_rad, double advance_m);

 private:
  [[nodiscard]] bool is_open(double direction_rad, double distance_m) const;

  const FreeSpace* space_;
  OdometryNoise motion_;
  ObstacleRule obstacles_;
  Pose2 pose_;
  Random random_;
  int side_ = 0;  // on which it goes past something: 1 left, -1 right
};

}  // namespace panonav::simulation
