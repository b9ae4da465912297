#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// A scene whose furniture people move day by day. Movable is an object that stands on the floor,
/// is no higher than 3 m, between 5 cm and 4 m wide both ways, and is no part of the building (a
/// name with "wall", "floor" or "ground"). Works for built-in scenes and for worlds from files.
class ChangingScene {
 public:
  ChangingScene(Scene scene, std::uint64_t seed);

  [[nodiscard]] std::size_t movable() const noexcept { return objects_.size(); }
  /// Counts objects that do not stand at their first position.
  [[nodiscard]] std::size_t moved() const noexcept;

  /// Moves each movable object with this probability, from where it stands now: by 1.5 to 4
  /// radii of the robot in any direction and turned by up to 0.6 rad, as `SceneVariation` moves
  /// things; within the floor, never into drivable areas or onto corners of the tour. One that
  /// finds no such place stays.
  void simulate_day(double share);

  /// Returns the present scene, with its light multiplied by `light`.
  [[nodiscard]] Scene scene(double light) const;

 private:
  struct Object {
    std::vector<std::size_t> meshes;
    Point2 first_centre;
    double radius_m = 0.0;  ///< of the disc that it covers
    Point2 centre;
    double turn_rad = 0.0;
  };
  [[nodiscard]] bool can_stand(const Object& object, Point2 centre) const;

  Scene scene_;
  FloorArea floor_;
  FloorArea all_;
  Random random_;
  std::vector<Object> objects_;
};

}  // namespace panonav::simulation
