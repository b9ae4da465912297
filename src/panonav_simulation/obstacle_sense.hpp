#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/navigation/floor_scanner.hpp"
#include "panonav_simulation/people.hpp"

namespace panonav::simulation {

/// Sensor for obstacles of the simulated robot of a mission.
enum class ObstacleSensor {
  bumper,  ///< contact, which stops the robot; it knows the side, as one of eight
  ranges,  ///< a ring of eight noisy ranges in addition to the bumper
  camera,  ///< the floor in the pictures of its camera in addition to the bumper
  truth,   ///< the true free space, which no real robot knows; for comparison only
};

/// Number of directions of the bumper and of the ring: 0, 45, ... degrees from the robot's forward
/// direction, counter-clockwise.
inline constexpr std::size_t sensor_directions = 8;
/// Largest range of the ring; obstacles farther off read as this range.
inline constexpr double max_range_m = 3.0;
/// Standard deviation of a range, as a fraction of it and in addition to it (chosen: an infrared
/// or ultrasonic range finder).
inline constexpr double range_noise_factor = 0.02;
inline constexpr double range_noise_m = 0.01;

/// Returns the direction of a sensor of the ring in the robot frame.
[[nodiscard]] double sensor_direction_rad(std::size_t sensor);

/// Measures the noisy distance from the robot's centre to the first obstacle or person in each
/// direction of the ring; `max_range_m` if there is none up to there or to the border of the map.
/// Without noise, at most 2 cells of `space` below the truth. `people` may be null.
/// `wall_outside_m`: distance from the map to a wall around it; nullopt: no wall.
[[nodiscard]] std::array<double, sensor_directions> measure_ranges(
    const FreeSpace& space, const People* people, const Pose2& robot, Random& random,
    std::optional<double> wall_outside_m = {});

/// Returns the direction of contact in the robot frame, as one of the bumper's eight, of a robot
/// that would touch an obstacle or a person at this pose.
[[nodiscard]] double sense_contact_rad(const FreeSpace& space, const People& people,
                                       const Pose2& robot, double robot_radius_m);

/// Returns the direction, as one of the bumper's eight, in which the free positions of `space` end
/// near `robot`; the one nearest to `course_rad` if they do not end.
[[nodiscard]] double sense_border_rad(const FreeSpace& space, const Pose2& robot,
                                      double course_rad);

/// Points in which a robot sensed obstacles within the last 10 s, in the robot frame.
class ObstacleMemory {
 public:
  void add(Point2 point) { points_.push_back({point, 0.0, false}); }
  /// Adds the points at which a ring of ranges ends, except those out of range, two standard
  /// deviations farther off: only what the noise leaves certain is an obstacle. Forgets earlier
  /// points of ranges in front of them.
  void add_ranges(const std::array<double, sensor_directions>& ranges_m);
  /// Adds the points at which the floor of a scan ends, its error farther off. Forgets earlier
  /// measured points in front of them.
  void add_scan(const FloorScan& scan);
  /// Moves the robot by its odometry, robot_old_from_robot_new.
  void move(const Pose2& step);
  /// Ages all points, and forgets the old ones.
  void advance(double seconds);
  /// True if a robot can drive the straight line of a length without touching a known point;
  /// without `heeds_ranges`, one that it felt.
  [[nodiscard]] bool is_open(double direction_rad, double length_m, double robot_radius_m,
                             bool heeds_ranges = true) const;

 private:
  struct Point {
    Point2 position;
    double age_s = 0.0;
    bool is_measured = false;
  };
  std::vector<Point> points_;
};

}  // namespace panonav::simulation
