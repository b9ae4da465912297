#include "panonav_simulation/obstacle_sense.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/geometry/angles.hpp"

namespace panonav::simulation {

namespace {

// Duration for which sensed points are kept (chosen: longer than passing a table takes, shorter
// than a person stands in the same place).
constexpr double max_point_age_s = 10.0;

// Half the width of the beam in which a range disproves earlier points (chosen: 5 degrees).
constexpr double max_beam_rad = 0.09;

// Error of the end of the floor in a scan: a step between the surfaces that a scanner tries.
constexpr double floor_scan_error_m = 0.05;

constexpr double direction_spacing_rad =
    2.0 * std::numbers::pi / static_cast<double>(sensor_directions);

Point2 find_point_at(const Pose2& robot, double direction_rad, double distance_m) {
  return robot * Point2{distance_m * std::cos(direction_rad), distance_m * std::sin(direction_rad)};
}

double round_to_sensor_rad(double direction_rad) {
  return wrap_angle(std::round(direction_rad / direction_spacing_rad) * direction_spacing_rad);
}

// True inside of the rectangle of the map, beyond which obstacles are unknown.
bool is_in_map(const FreeSpace& space, Point2 point) {
  return point.x_m >= space.low().x_m && point.x_m < space.high().x_m &&
         point.y_m >= space.low().y_m && point.y_m < space.high().y_m;
}

// Returns the distance to the rectangle of the map; 0 inside of it.
double distance_to_map_m(const FreeSpace& space, Point2 point) {
  const auto outside_m = [](double value, double low, double high) {
    return std::max({low - value, value - high, 0.0});
  };
  return std::hypot(outside_m(point.x_m, space.low().x_m, space.high().x_m),
                    outside_m(point.y_m, space.low().y_m, space.high().y_m));
}

// Returns the directions from the robot's centre in which its hull is sampled.
std::array<double, 72> hull_directions() {
  std::array<double, 72> directions_rad{};
  for (std::size_t i = 0; i < directions_rad.size(); ++i) {
    directions_rad[i] = 2.0 * std::numbers::pi * static_cast<double>(i) /
                        static_cast<double>(directions_rad.size());
  }
  return directions_rad;
}

}  // namespace

double sensor_direction_rad(std::size_t sensor) {
  return wrap_angle(static_cast<double>(sensor) * direction_spacing_rad);
}

std::array<double, sensor_directions> measure_ranges(const FreeSpace& space, const People* people,
                                                     const Pose2& robot, Random& random,
                                                     std::optional<double> wall_outside_m) {
  constexpr double step_m = 0.01;
  std::array<double, sensor_directions> ranges_m{};
  for (std::size_t sensor = 0; sensor < sensor_directions; ++sensor) {
    const double direction_rad = sensor_direction_rad(sensor);
    double range_m = 0.0;
    bool has_echo = false;
    while (range_m < max_range_m) {
      const Point2 there = find_point_at(robot, direction_rad, range_m);
      if (!is_in_map(space, there)) {
        has_echo = wall_outside_m && distance_to_map_m(space, there) >= *wall_outside_m;
        if (has_echo || !wall_outside_m) break;
      } else {
        has_echo = space.clearance_m(there) <= 0.0 ||
                   (people != nullptr && people->has_person_within(there, 0.0));
        if (has_echo) break;
      }
      range_m += step_m;
    }
    range_m += (range_noise_factor * range_m + range_noise_m) * random.normal();
    ranges_m[sensor] = has_echo ? std::clamp(range_m, 0.0, max_range_m) : max_range_m;
  }
  return ranges_m;
}

double sense_contact_rad(const FreeSpace& space, const People& people, const Pose2& robot,
                         double robot_radius_m) {
  // Averages the directions of the parts of the hull that are deepest in obstacles.
  double nearest_m = std::numeric_limits<double>::infinity();
  Point2 sum;
  for (const double direction_rad : hull_directions()) {
    const Point2 hull = find_point_at(robot, direction_rad, robot_radius_m);
    const double clearance_m = people.has_person_within(hull, 0.0) ? 0.0 : space.clearance_m(hull);
    if (clearance_m > nearest_m) continue;
    if (clearance_m < nearest_m) sum = {};
    nearest_m = clearance_m;
    sum = {sum.x_m + std::cos(direction_rad), sum.y_m + std::sin(direction_rad)};
  }
  return round_to_sensor_rad(std::atan2(sum.y_m, sum.x_m));
}

double sense_border_rad(const FreeSpace& space, const Pose2& robot, double course_rad) {
  // Averages the directions in which a position two cells away is not free.
  const double away_m = 0.25 * space.robot_radius_m();
  Point2 sum;
  for (const double direction_rad : hull_directions()) {
    if (space.is_free(find_point_at(robot, direction_rad, away_m))) continue;
    sum = {sum.x_m + std::cos(direction_rad), sum.y_m + std::sin(direction_rad)};
  }
  constexpr double min_sum = 1e-6;
  const bool has_side = std::hypot(sum.x_m, sum.y_m) > min_sum;
  return round_to_sensor_rad(has_side ? std::atan2(sum.y_m, sum.x_m) : course_rad);
}

void ObstacleMemory::add_ranges(const std::array<double, sensor_directions>& ranges_m) {
  const auto is_disproved = [&](const Point& point) {
    if (!point.is_measured) return false;
    const double direction_rad = std::atan2(point.position.y_m, point.position.x_m);
    const auto sensor = static_cast<std::size_t>(
        std::lround(direction_rad / direction_spacing_rad) + std::ptrdiff_t{sensor_directions});
    const double range_m = ranges_m[sensor % sensor_directions];
    const double aside_rad =
        std::remainder(direction_rad - sensor_direction_rad(sensor), 2.0 * std::numbers::pi);
    const double distance_m = std::hypot(point.position.x_m, point.position.y_m);
    return std::abs(aside_rad) < max_beam_rad && distance_m < range_m;
  };
  std::erase_if(points_, is_disproved);
  for (std::size_t sensor = 0; sensor < sensor_directions; ++sensor) {
    if (ranges_m[sensor] >= max_range_m) continue;
    const double direction_rad = sensor_direction_rad(sensor);
    const double certain_m =
        ranges_m[sensor] + 2.0 * (range_noise_factor * ranges_m[sensor] + range_noise_m);
    points_.push_back(
        {{certain_m * std::cos(direction_rad), certain_m * std::sin(direction_rad)}, 0.0, true});
  }
}

void ObstacleMemory::add_scan(const FloorScan& scan) {
  const auto sectors = static_cast<std::ptrdiff_t>(scan.range_m.size());
  std::erase_if(points_, [&](const Point& point) {
    if (!point.is_measured) return false;
    const double direction_rad = std::atan2(point.position.y_m, point.position.x_m);
    const std::ptrdiff_t sector =
        std::lround(direction_rad / (2.0 * std::numbers::pi) * static_cast<double>(sectors));
    const auto range_m = scan.range_m[static_cast<std::size_t>((sector + sectors) % sectors)];
    return range_m && std::hypot(point.position.x_m, point.position.y_m) < *range_m;
  });
  for (std::size_t i = 0; i < scan.range_m.size(); ++i) {
    const auto range_m = scan.range_m[i];
    if (!range_m || *range_m >= scan.max_range_m) continue;
    const double certain_m = *range_m + floor_scan_error_m;
    const double direction_rad = scan.azimuth_rad(i);
    points_.push_back(
        {{certain_m * std::cos(direction_rad), certain_m * std::sin(direction_rad)}, 0.0, true});
  }
}

void ObstacleMemory::move(const Pose2& step) {
  const Pose2 new_from_old = inverse(step);
  for (Point& point : points_) point.position = new_from_old * point.position;
}

void ObstacleMemory::advance(double seconds) {
  for (Point& point : points_) point.age_s += seconds;
  std::erase_if(points_, [](const Point& point) { return point.age_s > max_point_age_s; });
}

bool ObstacleMemory::is_open(double direction_rad, double length_m, double robot_radius_m,
                             bool heeds_ranges) const {
  const double c = std::cos(direction_rad);
  const double s = std::sin(direction_rad);
  return std::ranges::none_of(points_, [&](const Point& point) {
    if (point.is_measured && !heeds_ranges) return false;
    const double along_m = c * point.position.x_m + s * point.position.y_m;
    const double aside_m = c * point.position.y_m - s * point.position.x_m;
    if (along_m <= 0.0) return false;  // it drives away from the point
    return std::hypot(along_m - std::min(along_m, length_m), aside_m) < robot_radius_m;
  });
}

}  // namespace panonav::simulation
