#include "panonav_simulation/simulated_robot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/motion/velocity.hpp"

namespace panonav::simulation {

namespace {

constexpr int directions_per_side = 11;

Point2 point_ahead(const Pose2& pose, double direction_rad, double distance_m) {
  return pose * Point2{distance_m * std::cos(direction_rad), distance_m * std::sin(direction_rad)};
}

// Returns the length of the free part of the straight line, measured from `from`.
double free_length_m(const FreeSpace& space, Point2 from, Point2 to) {
  if (space.is_free_between(from, to)) return distance(from, to);
  double low = 0.0;
  double high = 1.0;
  constexpr int halvings = 12;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    const Point2 there{from.x_m + middle * (to.x_m - from.x_m),
                       from.y_m + middle * (to.y_m - from.y_m)};
    (space.is_free_between(from, there) ? low : high) = middle;
  }
  return low * distance(from, to);
}

}  // namespace

double distance_from_route_m(Point2 place, std::span<const Pose2> route) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < route.size(); ++i) {
    const Point2 a = route[i > 0 ? i - 1 : 0].position();
    const Point2 b = route[i].position();
    const double dx = b.x_m - a.x_m;
    const double dy = b.y_m - a.y_m;
    const double square = dx * dx + dy * dy;
    const double along =
        square > 0.0 ? ((place.x_m - a.x_m) * dx + (place.y_m - a.y_m) * dy) / square : 0.0;
    const double t = std::clamp(along, 0.0, 1.0);
    nearest_m = std::min(nearest_m, distance(place, {a.x_m + t * dx, a.y_m + t * dy}));
  }
  return nearest_m;
}

bool has_room_between(const FreeSpace& space, double robot_radius_m, Point2 from, Point2 to,
                      double spacing_m) {
  const int steps = std::max(1, static_cast<int>(std::ceil(distance(from, to) / spacing_m)));
  for (int i = 1; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    if (space.clearance_m({from.x_m + share * (to.x_m - from.x_m),
                           from.y_m + share * (to.y_m - from.y_m)}) < robot_radius_m) {
      return false;
    }
  }
  return true;
}

std::optional<OpenDirection> find_open_direction(double direct_rad, int directions_per_side,
                                                 int side,
                                                 const std::function<bool(double)>& is_open) {
  constexpr double direction_step_rad = std::numbers::pi / 12.0;
  for (int i = 1; i <= directions_per_side; ++i) {
    for (const int tried_side : {1, -1}) {
      if (side != 0 && tried_side != side) continue;
      const double direction_rad = direct_rad + tried_side * i * direction_step_rad;
      if (is_open(direction_rad)) return OpenDirection{direction_rad, tried_side};
    }
  }
  return std::nullopt;
}

SimulatedRobot::SimulatedRobot(const FreeSpace& space, const OdometryNoise& motion,
                               ObstacleRule obstacles, const Pose2& start, std::uint64_t seed,
                               ObstacleSensor sensor, const FloorCamera* floor_camera)
    : space_(&space),
      motion_(motion),
      obstacles_(obstacles),
      pose_(start),
      random_(seed, 1),
      sensor_(sensor),
      noise_of_ranges_(seed, 5) {
  validate(motion);
  if (!space.is_free(start.position())) {
    throw ContractError("start of the robot", "an obstacle", "a free place");
  }
  if (sensor == ObstacleSensor::camera) {
    require_floor_camera(floor_camera);
    floor_.emplace(*floor_camera, nullptr, seed);
  }
}

bool SimulatedRobot::is_open(double direction_rad, double distance_m) const {
  if (sensor_ != ObstacleSensor::truth) {
    return known_.is_open(direction_rad, distance_m, space_->robot_radius_m());
  }
  return space_->is_free_between(pose_.position(), point_ahead(pose_, direction_rad, distance_m));
}

std::optional<double> SimulatedRobot::find_free_direction(double direct_rad, double advance_m) {
  if (is_open(direct_rad, advance_m)) {
    detour_side_ = 0;
    return direct_rad;
  }
  const auto find_on_preferred_side = [&] {
    return find_open_direction(
        direct_rad, directions_per_side, detour_side_,
        [&](double direction_rad) { return is_open(direction_rad, 0.5 * advance_m); });
  };
  auto free_direction = find_on_preferred_side();
  if (!free_direction && detour_side_ != 0) {
    detour_side_ = -detour_side_;
    free_direction = find_on_preferred_side();
  }
  if (!free_direction) return std::nullopt;
  detour_side_ = free_direction->side;
  return free_direction->direction_rad;
}

SimulatedRobot::Step SimulatedRobot::drive(double direct_rad, double advance_m) {
  if (obstacles_ == ObstacleRule::stop) {
    const bool is_stopped = !drive_until_contact(direct_rad, advance_m);
    return {is_stopped, is_stopped};
  }
  known_.advance(advance_m / BaseOptions{}.speed_m_s);
  if (sensor_ == ObstacleSensor::ranges) {
    known_.add_ranges(measure_ranges(*space_, nullptr, pose_, noise_of_ranges_));
  }
  if (floor_) known_.add_scan(floor_->scan(pose_));
  Step step;
  bool has_forgotten = false;
  constexpr int max_contacts = 2 * directions_per_side + 1;  // directions that it tries
  for (int contacts = 0; contacts < max_contacts; ++contacts) {
    const auto free_rad = find_free_direction(direct_rad, advance_m);
    step.has_met_obstacle |= free_rad != direct_rad;
    if (!free_rad) {
      // Contacts are known to 22.5 degrees only, so it feels again before it gives up.
      if (has_forgotten || sensor_ == ObstacleSensor::truth) break;
      has_forgotten = true;
      known_ = {};
      continue;
    }
    const Pose2 before = pose_;
    if (drive_until_contact(*free_rad, advance_m)) return step;
    step.has_met_obstacle = true;
    if (sensor_ == ObstacleSensor::truth) return step;
    const bool has_advanced = distance(before.position(), pose_.position()) >= 0.5 * advance_m;
    const bool has_turned = motion_.drive == DriveKind::differential;
    const double course_rad = has_turned ? 0.0 : *free_rad;
    // The side of a contact is known to 22.5 degrees only: if one more follows, it is its course
    // that is blocked.
    if (contacts > 0) {
      const double radius_m = space_->robot_radius_m();
      known_.add({radius_m * std::cos(course_rad), radius_m * std::sin(course_rad)});
    }
    back_off_from_contact(course_rad);
    if (has_advanced) return step;
    if (has_turned) direct_rad = wrap_angle(direct_rad - *free_rad);
  }
  step.is_stopped = true;
  return step;
}

bool SimulatedRobot::drive_until_contact(double direction_rad, double advance_m) {
  const Pose2 before = pose_;
  const bool is_differential = motion_.drive == DriveKind::differential;
  const Pose2 rotation{0.0, 0.0, is_differential ? wrap_angle(direction_rad) : 0.0};
  const double course_rad = is_differential ? 0.0 : direction_rad;
  const Pose2 translation{advance_m * std::cos(course_rad), advance_m * std::sin(course_rad), 0.0};
  Pose2 after;
  if (is_differential) {
    const Pose2 turned = sample_step(rotation, motion_, random_);
    after = Pose2{before.x_m, before.y_m, wrap_angle(before.heading_rad + turned.heading_rad)} *
            sample_step(translation, motion_, random_);
  } else {
    after = before * sample_step(translation, motion_, random_);
  }
  const double step_length_m = distance(before.position(), after.position());
  const double free_m = free_length_m(*space_, before.position(), after.position());
  const double fraction = free_m >= step_length_m ? 1.0 : free_m / step_length_m;
  pose_ = after;
  if (fraction < 1.0) {
    pose_ = {before.x_m + fraction * (after.x_m - before.x_m),
             before.y_m + fraction * (after.y_m - before.y_m), after.heading_rad};
  }
  // Odometry measures the part that was driven.
  move_sensors(rotation, {fraction * translation.x_m, fraction * translation.y_m, 0.0}, before);
  return fraction >= 1.0;
}

// Moves the memory and the camera by odometry: by a rotation at the true pose `start`, then along
// a straight line to the current pose.
void SimulatedRobot::move_sensors(const Pose2& rotation, const Pose2& translation,
                                  const Pose2& start) {
  known_.move(rotation * translation);
  if (!floor_) return;
  constexpr double spacing_m = 0.05;
  const double length_m = std::hypot(translation.x_m, translation.y_m);
  const int parts = std::max(1, static_cast<int>(length_m / spacing_m));
  floor_->move(rotation, {start.x_m, start.y_m, pose_.heading_rad});
  for (int i = 1; i <= parts; ++i) {
    const double share = static_cast<double>(i) / parts;
    floor_->move({translation.x_m / parts, translation.y_m / parts, 0.0},
                 {start.x_m + share * (pose_.x_m - start.x_m),
                  start.y_m + share * (pose_.y_m - start.y_m), pose_.heading_rad});
  }
}

void SimulatedRobot::back_off_from_contact(double direction_rad) {
  const double radius_m = space_->robot_radius_m();
  const double contact_rad = sense_border_rad(*space_, pose_, direction_rad);
  known_.add({radius_m * std::cos(contact_rad), radius_m * std::sin(contact_rad)});
  // A tenth of the radius leaves room for driving along a wall.
  const double back_m = 0.1 * radius_m;
  const Pose2 back{-back_m * std::cos(direction_rad), -back_m * std::sin(direction_rad), 0.0};
  const Pose2 there = pose_ * back;
  if (!space_->is_free_between(pose_.position(), there.position())) return;
  const Pose2 before = std::exchange(pose_, there);
  move_sensors({}, back, before);
}

}  // namespace panonav::simulation
