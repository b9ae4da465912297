#include "panonav_simulation/people.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::simulation {

namespace {

constexpr double person_radius_m = 0.22;
constexpr double person_height_m = 1.7;
constexpr double walking_speed_m_s = 0.8;
// Distance that people keep from the robot, and time that they wait in front of it before they
// choose another path.
constexpr double min_robot_distance_m = 0.15;
constexpr double max_wait_s = 2.0;

// True if no obstacle at the robot's height is on the straight line.
bool has_line_of_sight(const FreeSpace& space, Point2 from, Point2 to) {
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

bool People::has_person_within(Point2 position, double radius_m) const {
  return std::ranges::any_of(people_, [&](const Person& person) {
    return distance(person.position, position) < radius_m + person_radius_m;
  });
}

void People::choose_path(Person& person) {
  person.waited_s = 0.0;
  const auto path = space_->shortest_path(person.position, space_->random_pose(random_).position());
  person.path = path.value_or(std::vector<Point2>{});
  std::ranges::reverse(person.path);
}

void People::advance(double seconds, Point2 robot, double robot_radius_m) {
  for (Person& person : people_) {
    if (person.path.empty()) choose_path(person);
    double left_m = walking_speed_m_s * seconds;
    while (left_m > 0.0 && !person.path.empty()) {
      const Point2 to = person.path.back();
      const double far_m = distance(person.position, to);
      const double share = far_m > left_m ? left_m / far_m : 1.0;
      const Point2 there{person.position.x_m + share * (to.x_m - person.position.x_m),
                         person.position.y_m + share * (to.y_m - person.position.y_m)};
      const double apart_m = distance(there, robot);
      // A person who is already too near may still walk away.
      if (apart_m < robot_radius_m + person_radius_m + min_robot_distance_m &&
          apart_m < distance(person.position, robot)) {
        person.waited_s += seconds;
        if (person.waited_s > max_wait_s) choose_path(person);
        break;
      }
      person.position = there;
      left_m -= far_m;
      if (share == 1.0) person.path.pop_back();
    }
  }
}

void People::paint(Panorama& view, const Pose2& camera, double camera_height_m) const {
  if (!view.elevations()) return;
  // Draw the nearest people last, because they hide those behind them.
  std::vector<const Person*> seen;
  for (const Person& person : people_) {
    if (has_line_of_sight(*space_, camera.position(), person.position)) seen.push_back(&person);
  }
  const auto far_m = [&](const Person* person) {
    return std::max(distance(camera.position(), person->position), 1.05 * person_radius_m);
  };
  std::ranges::stable_sort(seen, std::greater{}, far_m);
  for (const Person* person : seen) {
    const Point2 there = inverse(camera) * person->position;
    const double bearing_rad = std::atan2(there.y_m, there.x_m);
    const double half_width_rad = std::asin(person_radius_m / far_m(person));
    const double near_m = far_m(person) - person_radius_m;
    const double feet_rad = std::atan2(-camera_height_m, near_m);
    const double head_rad = std::atan2(person_height_m - camera_height_m, near_m);
    // Trousers are darker than the upper clothes.
    const double belt_rad = std::atan2(0.55 * person_height_m - camera_height_m, near_m);
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
