#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav_simulation/floor_camera.hpp"
#include "panonav_simulation/free_space.hpp"
#include "panonav_simulation/obstacle_sense.hpp"

namespace panonav::simulation {

/// True if a robot can drive the straight line without contact, checked at steps of at most
/// `spacing_m` after `from`. Borders of drivable areas are not obstacles.
[[nodiscard]] bool has_room_between(const FreeSpace& space, double robot_radius_m, Point2 from,
                                    Point2 to, double spacing_m);

/// Returns the distance from a position to the polyline through the poses; infinity if there are no
/// poses.
[[nodiscard]] double distance_from_route_m(Point2 place, std::span<const Pose2> route);

/// A direction that is open, and its side: left (1) or right (-1) of the intended direction.
struct OpenDirection {
  double direction_rad = 0.0;
  int side = 0;
};
/// Finds the open direction nearest to `direct_rad`, in steps of 15 degrees to the left and right;
/// on one side only if `side` is not 0. nullopt if none is open.
[[nodiscard]] std::optional<OpenDirection> find_open_direction(
    double direct_rad, int directions_per_side, int side,
    const std::function<bool(double direction_rad)>& is_open);

/// Behaviour of a robot at an obstacle.
enum class ObstacleRule {
  stop,  ///< it stops there, which ends the run
  /// Drives around obstacles: tries directions left and right of the requested one, in steps of 15
  /// degrees up to 165 degrees, and takes the nearest in which half a step is free as far as its
  /// sensor knows. While the requested direction stays blocked it keeps the chosen side; if that
  /// side is blocked too, it tries the other one. After contact it backs off and tries again. If no
  /// direction is free, it stops.
  pass,
};

/// A robot in a simulated place that executes motion commands with errors. Holds the true pose and
/// the random streams of its errors.
class SimulatedRobot {
 public:
  /// Outcome of a step.
  struct Step {
    bool has_met_obstacle = false;  ///< it touched or avoided an obstacle
    bool is_stopped = false;        ///< it does not drive on
  };

  /// `space` and `floor_camera`, with which the robot sees if its sensor is the camera, must
  /// outlive the robot. Throws OptionError, and ContractError if `start` is not free or the camera
  /// is missing.
  SimulatedRobot(const FreeSpace& space, const OdometryNoise& motion, ObstacleRule obstacles,
                 const Pose2& start, std::uint64_t seed,
                 ObstacleSensor sensor = ObstacleSensor::bumper,
                 const FloorCamera* floor_camera = nullptr);

  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }

  /// Drives a step of `advance_m` towards `direct_rad`, in the robot frame, by its rule at
  /// obstacles. Remembers where it felt or measured obstacles, and the side of the detour.
  Step drive(double direct_rad, double advance_m);

 private:
  [[nodiscard]] bool is_open(double direction_rad, double distance_m) const;
  [[nodiscard]] std::optional<double> find_free_direction(double direct_rad, double advance_m);
  [[nodiscard]] bool drive_until_contact(double direction_rad, double advance_m);
  void back_off_from_contact(double direction_rad);
  void move_sensors(const Pose2& rotation, const Pose2& translation, const Pose2& start);

  const FreeSpace* space_;
  OdometryNoise motion_;
  ObstacleRule obstacles_;
  Pose2 pose_;
  Random random_;
  ObstacleSensor sensor_;
  Random noise_of_ranges_;
  std::optional<FloorSensor> floor_;
  ObstacleMemory known_;
  int detour_side_ = 0;  // side of the last detour: 1 left, -1 right, 0 none
};

}  // namespace panonav::simulation
