#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/geometry/angles.hpp"
#include "panonav_simulation/mission.hpp"
#include "panonav_simulation/simulated_robot.hpp"

namespace panonav::simulation {

MissionRobot::MissionRobot(const MissionPlace& place, const BaseOptions& base,
                           const OdometryNoise& motion, const Pose2& start, std::uint64_t seed,
                           int people, ObstacleSensor obstacles)
    : space_(place.free_space.get()),
      robot_radius_m_(place.scene.robot_radius_m),
      people_(place.free_space, people, seed),
      base_(base),
      motion_(motion),
      pose_(start),
      random_(seed, 1),
      sensor_(obstacles),
      noise_of_ranges_(seed, 5) {
  validate(base_);
  motion_.drive = base_.drive;
  validate(motion_);
  if (sensor_ == ObstacleSensor::camera) {
    require_floor_camera(place.floor_camera.get());
    floor_.emplace(*place.floor_camera, &people_, seed);
  }
}

bool MissionRobot::has_clear_path(Point2 from, Point2 to) const {
  // A person who already touches the robot must not prevent it from moving away.
  const bool is_person_in_path = people_.has_person_within(to, robot_radius_m_) &&
                                 !people_.has_person_within(from, robot_radius_m_);
  constexpr double fine_m = 0.01;
  return !is_person_in_path && has_room_between(*space_, robot_radius_m_, from, to, fine_m);
}

void MissionRobot::wait(double seconds) {
  people_.advance(seconds, pose_.position(), robot_radius_m_);
  known_.advance(seconds);
}

Pose2 MissionRobot::take_odometry() noexcept {
  return std::exchange(odometry_, Pose2{});
}

void MissionRobot::command(const Velocity& velocity) {
  wait(base_.period_s);
  const Pose2 commanded = integrate_velocity(velocity, base_.period_s);
  const Pose2 step = sample_step(commanded, motion_, random_);
  const Pose2 there = pose_ * step;
  if (!has_clear_path(pose_.position(), there.position())) {
    // In contact, the robot only rotates. A rotation on the spot shows no obstacle ahead.
    const bool is_driving = commanded.x_m != 0.0 || commanded.y_m != 0.0;
    obstacle_ |= is_driving;
    contacts_ += is_driving ? 1 : 0;
    const Pose2 rotation{0.0, 0.0, commanded.heading_rad};
    pose_.heading_rad = there.heading_rad;
    odometry_ = odometry_ * rotation;
    known_.move(rotation);
    if (floor_) floor_->move(rotation, pose_);
    contact_rad_ = sense_contact_rad(*space_, people_, there, robot_radius_m_);
    known_.add(
        {robot_radius_m_ * std::cos(contact_rad_), robot_radius_m_ * std::sin(contact_rad_)});
    contact_velocity_ = velocity;
    return;
  }
  known_.move(commanded);
  odometry_ = odometry_ * commanded;
  travelled_m_ += std::hypot(step.x_m, step.y_m);
  pose_ = there;
  if (floor_) floor_->move(commanded, pose_);
}

void MissionRobot::back_off() {
  // A tenth of the radius leaves room for a rotation and for driving along a wall.
  const double back_m = 0.1 * robot_radius_m_;
  const double step_m =
      base_.period_s * std::hypot(contact_velocity_.forward_m_s, contact_velocity_.left_m_s);
  if (step_m <= 0.0) return;
  const double factor = std::min(1.0, back_m / step_m);
  const Velocity back{.forward_m_s = -factor * contact_velocity_.forward_m_s,
                      .left_m_s = -factor * contact_velocity_.left_m_s};
  for (double driven_m = 0.0; driven_m < back_m && !obstacle_; driven_m += factor * step_m) {
    command(back);
  }
  obstacle_ = false;
}

std::array<double, sensor_directions> MissionRobot::read_ranges() {
  return measure_ranges(*space_, &people_, pose_, noise_of_ranges_, robot_radius_m_);
}

std::optional<double> MissionRobot::find_free_direction(double direct_rad, double distance_m) {
  if (sensor_ == ObstacleSensor::ranges) {
    known_.add_ranges(measure_ranges(*space_, &people_, pose_, noise_of_ranges_));
  }
  if (floor_) known_.add_scan(floor_->scan(pose_));
  bool heeds_ranges = true;
  const auto is_open = [&](double direction_rad, double length_m) {
    if (sensor_ != ObstacleSensor::truth) {
      return known_.is_open(direction_rad, length_m, robot_radius_m_, heeds_ranges);
    }
    const Point2 there =
        pose_ * Point2{length_m * std::cos(direction_rad), length_m * std::sin(direction_rad)};
    return has_clear_path(pose_.position(), there);
  };
  const auto find_direction = [&]() -> std::optional<OpenDirection> {
    if (is_open(direct_rad, distance_m)) return OpenDirection{direct_rad, 0};
    // Beyond 90 degrees it would turn back, and the navigator must learn of the blocked path.
    constexpr int directions_per_side = 6;
    return find_open_direction(
        direct_rad, directions_per_side, detour_side_,
        [&](double direction_rad) { return is_open(direction_rad, 0.5 * distance_m); });
  };
  auto free_direction = find_direction();
  if (!free_direction && sensor_ != ObstacleSensor::truth) {
    // Between noisy ranges a door may seem too narrow; the bumper tells.
    heeds_ranges = false;
    free_direction = find_direction();
  }
  detour_side_ = free_direction ? free_direction->side : -detour_side_;
  if (!free_direction) return std::nullopt;
  return free_direction->side == 0 ? direct_rad : wrap_angle(free_direction->direction_rad);
}

bool MissionRobot::take_contact() noexcept {
  return std::exchange(obstacle_, false);
}

bool drive_step(MissionRobot& robot, const BaseOptions& base, double direct_rad,
                double distance_m) {
  Point2 target{distance_m * std::cos(direct_rad), distance_m * std::sin(direct_rad)};
  constexpr double near_m = 0.003;
  const double max_duration_s =
      2.0 * (std::numbers::pi / base.turn_rad_s + distance_m / base.speed_m_s) + 1.0;
  for (double time_s = 0.0; time_s < max_duration_s; time_s += base.period_s) {
    const double left_m = std::hypot(target.x_m, target.y_m);
    if (left_m <= near_m) return false;
    const Velocity velocity =
        compute_command_towards(std::atan2(target.y_m, target.x_m), left_m, base);
    robot.command(velocity);
    if (robot.take_contact()) return true;
    target = inverse(integrate_velocity(velocity, base.period_s)) * target;
  }
  return false;
}

}  // namespace panonav::simulation
