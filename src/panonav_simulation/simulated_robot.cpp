#include "panonav_simulation/simulated_robot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/core/error.hpp"

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
                               ObstacleRule obstacles, const Pose2& start, std::uint64_t seed)
    : space_(&space), motion_(motion), obstacles_(obstacles), pose_(start), random_(seed, 1) {
  validate(motion);
  if (!space.is_free(start.position())) {
    throw ContractError("start of the robot", "an obstacle", "a free place");
  }
}

bool SimulatedRobot::is_open(double direction_rad, double distance_m) const {
  return space_->is_free_between(pose_.position(), point_ahead(pose_, direction_rad, distance_m));
}

std::optional<double> SimulatedRobot::find_free_direction(double direct_rad, double advance_m) {
  if (is_open(direct_rad, advance_m)) {
    detour_side_ = 0;
    return direct_rad;
  }
  if (obstacles_ == ObstacleRule::stop) return std::nullopt;
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

bool SimulatedRobot::go(double direction_rad, double advance_m) {
  const Pose2 before = pose_;
  Pose2 after;
  if (motion_.drive == DriveKind::differential) {
    const Pose2 turned = sample_step({0.0, 0.0, wrap_angle(direction_rad)}, motion_, random_);
    after = Pose2{before.x_m, before.y_m, wrap_angle(before.heading_rad + turned.heading_rad)} *
            sample_step({advance_m, 0.0, 0.0}, motion_, random_);
  } else {
    after = before * sample_step({advance_m * std::cos(direction_rad),
                                  advance_m * std::sin(direction_rad), 0.0},
                                 motion_, random_);
  }
  const double step_length_m = distance(before.position(), after.position());
  const double free_m = free_length_m(*space_, before.position(), after.position());
  if (free_m >= step_length_m) {
    pose_ = after;
    return true;
  }
  const double share = free_m / step_length_m;
  pose_ = {before.x_m + share * (after.x_m - before.x_m),
           before.y_m + share * (after.y_m - before.y_m), after.heading_rad};
  return false;
}

}  // namespace panonav::simulation
