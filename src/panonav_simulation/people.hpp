#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav_simulation/free_space.hpp"

namespace panonav::simulation {

/// People who walk about in a place: upright cylinders that walk between random free positions on
/// shortest paths. They stop in front of the robot, and choose another path if it does not move
/// away. The same seed and the same robot motion give the same walks.
class People {
 public:
  /// Throws ContractError unless `count` >= 0.
  People(std::shared_ptr<const FreeSpace> space, int count, std::uint64_t seed);

  [[nodiscard]] std::size_t size() const noexcept { return people_.size(); }
  [[nodiscard]] Point2 position(std::size_t person) const { return people_.at(person).position; }
  /// True if a person is within `radius_m` of a position.
  [[nodiscard]] bool has_person_within(Point2 position, double radius_m) const;
  /// Moves all people for a time, during which the robot is at `robot`.
  void advance(double seconds, Point2 robot, double robot_radius_m);
  /// Draws the visible people into the view of a camera `camera_height_m` above the floor. Does
  /// nothing if the elevations of the view are unknown.
  void paint(Panorama& view, const Pose2& camera, double camera_height_m) const;

 private:
  struct Person {
    Point2 position;
    std::vector<Point2> path;  // remaining way points, the next one last
    float brightness = 0.0F;   // brightness of the clothes
    double waited_s = 0.0;
  };
  void choose_path(Person& person);

  std::shared_ptr<const FreeSpace> space_;
  std::vector<Person> people_;
  Random random_;
};

}  // namespace panonav::simulation
