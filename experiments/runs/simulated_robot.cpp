#include "experiments/runs/simulated_robot.hpp"

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

constexpr double feeler_spacing_rad = std::numbers::pi / 12.0;
constexpr int feelers_each_side = 11;

Point2 ahead(const Pose2& pose, double direction_rad, double distance_m) {
  return pose * Point2{distance_m * std::cos(direction_rad), distance_m * std::sin(direction_rad)};
}

// Length of the free part of the straight way, at most `distance_m`.
double free_way_m(const FreeSpace& space, Point2 from, Point2 to) {
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

SimulatedRobot::SimulatedRobot(const FreeSpace& space, const OdometryNoise& motion,
                               ObstacleRule obstacles, const Pose2& start, std::uint64_t seed)
    : space_(&space), motion_(motion), obstacles_(obstacles), pose_(start), random_(seed, 1) {
  validate(motion);
  if (!space.is_free(start.position())) {
    throw ContractError("start of the robot", "an obstacle", "a free place");
  }
}

bool SimulatedRobot::is_open(double direction_rad, double distance_m) const {
  return space_->is_free_between(pose_.position(), ahead(pose_, direction_rad, distance_m));
}

std::optional<double> SimulatedRobot::open_on_side(double wanted_rad, double advance_m, int side,
                                                   int feeler) const {
  const double direction_rad = wanted_rad + side * feeler * feeler_spacing_rad;
  if (!is_open(direction_rad, 0.5 * advance_m)) return std::nullopt;
  return direction_rad;
}

std::optional<double> SimulatedRobot::free_direction(double wanted_rad, double advance_m) {
  if (is_open(wanted_rad, advance_m)) {
    side_ = 0;
    return wanted_rad;
  }
  if (obstacles_ == ObstacleRule::stop) return std::nullopt;
  const int kept = side_;
  for (int i = 1; i <= feelers_each_side; ++i) {
    for (const int side : {1, -1}) {
      if (kept != 0 && side != kept) continue;
      const auto direction_rad = open_on_side(wanted_rad, advance_m, side, i);
      if (!direction_rad) continue;
      side_ = side;
      return direction_rad;
    }
  }
  if (kept == 0) return std::nullopt;
  side_ = -kept;
  for (int i = 1; i <= feelers_each_side; ++i) {
    const auto direction_rad = open_on_side(wanted_rad, advance_m, side_, i);
    if (direction_rad) return direction_rad;
  }
  return std::nullopt;
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
  const double way_m = distance(before.position(), after.position());
  const double free_m = free_way_m(*space_, before.position(), after.position());
  if (free_m >= way_m) {
    pose_ = after;
    return true;
  }
  const double share = free_m / way_m;
  pose_ = {before.x_m + share * (after.x_m - before.x_m),
           before.y_m + share * (after.y_m - before.y_m), after.heading_rad};
  return false;
}

}  // namespace panonav
