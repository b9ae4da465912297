#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// A scene whose furniture is moved day by day. An object is movable if it stands on the floor, is
/// at most 3 m high, is 5 cm to 4 m wide in both directions, and is not part of the building (a
/// name with "wall", "floor" or "ground"). Works for built-in scenes and for worlds from files.
class ChangingScene {
 public:
  ChangingScene(Scene scene, std::uint64_t seed);

  [[nodiscard]] std::size_t movable() const noexcept { return objects_.size(); }
  /// Counts the objects that are no longer at their first position.
  [[nodiscard]] std::size_t moved() const noexcept;

  /// Moves each movable object with probability `share` from its present position: by 1.5 to 4
  /// robot radii in any direction, rotated by up to 0.6 rad, as `SceneVariation` moves things.
  /// Objects stay within the floor and never move into drivable areas or onto corners of the tour.
  /// An object without such a position stays.
  void simulate_day(double share);

  /// Returns the present scene, with its light multiplied by `light`.
  [[nodiscard]] Scene scene(double light) const;

 private:
  struct Object {
    std::vector<std::size_t> meshes;
    Point2 first_centre;
    double radius_m = 0.0;  ///< of the disc that contains its footprint
    Point2 centre;
    double turn_rad = 0.0;
  };
  [[nodiscard]] bool is_valid_position(const Object& object, Point2 centre) const;

  Scene scene_;
  FloorArea floor_area_;
  FloorArea scene_extent_;
  Random random_;
  std::vector<Object> objects_;
};

}  // namespace panonav::simulation
