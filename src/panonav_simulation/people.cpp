#include "panonav_simulation/people.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::simulation {

namespace {

constexpr double radius_m = 0.22;
constexpr double height_m = 1.7;
constexpr double pace_m_s = 0.8;
// Distance that a person keeps from a robot, and time that it waits in front of one.
constexpr double distance_kept_m = 0.15;
constexpr double patience_s = 2.0;

// True if nothing that a robot would touch stands on the straight line.
bool is_in_sight(const FreeSpace& space, Point2 from, Point2 to) {
  constexpr double step_m = 0.05;
  const int steps = static_cast<int>(std::ceil(distance(from, to) / step_m));
  for (int i = 1; i < steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    const Point2 at{from.x_m + share * (to.x_m - from.x_m), from.y_m + share * (to.y_m - from.y_m)};
    if (!(space.clearance_m(at) > 0.0)) return false;
  }
  return true;
}

}  // namespace

People::People(std::shared_ptr<const FreeSpace> space, int count, std::uint64_t seed)
    : space_(std::move(space)), random_(seed, 4) {
  require(count >= 0, "people", count, ">= 0");
  for (int i = 0; i < count; ++i) {
    people_.push_back({space_->random_pose(random_).position(), {}, 0.0F, 0.0});
    people_.back().brightness = static_cast<float>(random_.uniform(0.05, 0.8));
  }
}

bool People::touch(Point2 position, double at_most_m) const {
  return std::ranges::any_of(people_, [&](const Person& person) {
    return distance(person.position, position) < at_most_m + radius_m;
  });
}

void People::choose_path(Person& person) {
  person.waited_s = 0.0;
  const auto way = space_->shortest_path(person.position, space_->random_pose(random_).position());
  person.way = way.value_or(std::vector<Point2>{});
  std::ranges::reverse(person.way);
}

void People::pass(double seconds, Point2 robot, double robot_radius_m) {
  for (Person& person : people_) {
    if (person.way.empty()) choose_path(person);
    double left_m = pace_m_s * seconds;
    while (left_m > 0.0 && !person.way.empty()) {
      const Point2 to = person.way.back();
      const double far_m = distance(person.position, to);
      const double share = far_m > left_m ? left_m / far_m : 1.0;
      const Point2 there{person.position.x_m + share * (to.x_m - person.position.x_m),
                         person.position.y_m + share * (to.y_m - person.position.y_m)};
      const double apart_m = distance(there, robot);
      // A person who is already near may move away.
      if (apart_m < robot_radius_m + radius_m + distance_kept_m &&
          apart_m < distance(person.position, robot)) {
        person.waited_s += seconds;
        if (person.waited_s > patience_s) choose_path(person);
        break;
      }
      person.position = there;
      left_m -= far_m;
      if (share == 1.0) person.way.pop_back();
    }
  }
}

void People::paint(Panorama& view, const Pose2& camera, double camera_height_m) const {
  if (!view.elevations()) return;
  // The nearest are painted last: they hide those behind them.
  std::vector<const Person*> seen;
  for (const Person& person : people_) {
    if (is_in_sight(*space_, camera.position(), person.position)) seen.push_back(&person);
  }
  const auto far_m = [&](const Person* person) {
    return std::max(distance(camera.position(), person->position), 1.05 * radius_m);
  };
  std::ranges::stable_sort(seen, std::greater{}, far_m);
  for (const Person* person : seen) {
    const Point2 there = inverse(camera) * person->position;
    const double bearing_rad = std::atan2(there.y_m, there.x_m);
    const double half_width_rad = std::asin(radius_m / far_m(person));
    const double near_m = far_m(person) - radius_m;
    const double feet_rad = std::atan2(-camera_height_m, near_m);
    const double head_rad = std::atan2(height_m - camera_height_m, near_m);
    // Trousers are darker than the clothes above.
    const double belt_rad = std::atan2(0.55 * height_m - camera_height_m, near_m);
    for (int c = 0; c < view.columns(); ++c) {
      if (std::abs(angle_difference(view.azimuth_rad(c), bearing_rad)) > half_width_rad) continue;
      for (int y = 0; y < view.rows(); ++y) {
        const double elevation_rad = view.elevation_rad(y);
        if (elevation_rad < feet_rad || elevation_rad > head_rad) continue;
        view.at(y, c) = elevation_rad < belt_rad ? 0.5F * person->brightness : person->brightness;
      }
    }
  }
}

}  // namespace panonav::simulation
