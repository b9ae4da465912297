#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav_simulation/scene.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/texture.hpp"

namespace panonav::simulation {

/// Pose of a piece of furniture: its middle on the floor and its yaw.
struct Footing {
  Point2 centre;          ///< in the scene
  double turn_rad = 0.0;  ///< counter-clockwise seen from above
};

/// Colours of the furniture of a scene. Rooms are furnished from few suppliers: pieces of a kind
/// look similar, so that a view has large dark and bright parts and not only small ones.
struct Palette {
  Colour wood;   ///< of desks and shelves
  Colour paint;  ///< of drawers and cabinets
  Colour cloth;  ///< of chairs
  Colour metal;  ///< of legs
};

/// Builds a built-in scene. Random numbers come in two streams: one for the scene, one for the
/// moved objects, so that moving objects changes nothing else.
class SceneBuilder {
 public:
  /// Starts an empty scene; colours of the palette are drawn at once.
  SceneBuilder(std::string name, const SceneVariation& variation);

  [[nodiscard]] Random& random() noexcept { return random_; }  ///< source of all draws of the scene
  /// Returns the scene so far, for anything that the functions below do not make.
  [[nodiscard]] Scene& scene() noexcept { return scene_; }
  /// Returns the palette drawn at construction.
  [[nodiscard]] const Palette& palette() const noexcept { return palette_; }

  /// Adds a material of one colour and returns its number. `emission` as of `Material`.
  int add_plain_material(Colour colour, float emission = 0.0F);
  /// Adds a material with a texture and returns its number.
  int add_textured_material(Image image, float emission = 0.0F);

  /// Adds a flat quadrilateral with corners a b c d; the texture's lower edge runs from a to b and
  /// it repeats `repeat_u` by `repeat_v` times.
  void add_quadrilateral(const std::string& object, int material, Vector3 a, Vector3 b, Vector3 c,
                         Vector3 d, double repeat_u = 1.0, double repeat_v = 1.0);

  /// Adds a box of `size` whose bottom centre is at `at` in the frame of `footing`. Side faces show
  /// one copy of the texture each `tile_m` metres; 0 shows one copy a face.
  void add_box(const std::string& object, int sides, int top, const Footing& footing, Vector3 at,
               Vector3 size, double tile_m = 0.0);

  /// Adds an upright cylinder or cone, closed at the top: `bottom_radius_factor` times as wide at
  /// the bottom as at the top.
  void add_cylinder(const std::string& object, int material, Point2 centre, double bottom_m,
                    double top_m, double radius_m, int facets = 16,
                    double bottom_radius_factor = 1.0);

  /// Adds a round body with random dents and bumps: tree crowns, bushes. `roughness` is the
  /// standard deviation of its radius.
  void add_blob(const std::string& object, int material, Vector3 centre, Vector3 radii,
                double roughness);

  /// Adds a wall from a to b, seen from both sides, with the texture repeating every `tile_m`.
  void add_wall(const std::string& object, int material, Point2 from, Point2 to, double height_m,
                double tile_m, double bottom_m = 0.0);

  /// Adds a picture, window or door on the wall from `from` to `to`, `along_m` from its start,
  /// `before_m` before it on the left-hand side.
  void add_on_wall(const std::string& object, int material, Point2 from, Point2 to, double along_m,
                   double width_m, double bottom_m, double top_m, double before_m = 0.01);

  /// Adds a level rectangle, the texture repeating every `tile_m`; its object is called "floor".
  void add_floor(int material, Point2 low, Point2 high, double tile_m, double height_m = 0.0);
  /// Adds a level rectangle seen from below, `height_m` above the floor; its object is called
  /// "ceiling".
  void add_ceiling(int material, Point2 low, Point2 high, double height_m, double tile_m);

  /// Places a movable object that is planned at `planned` and covers a disc of `radius_m`:
  /// moved by up to four radii of the robot with the variation's share, but never into a drivable
  /// area, onto a corner of the tour or out of the floor's surroundings `room`.
  Footing place_movable(const Footing& planned, double radius_m, const FloorArea& room);

  /// True if a disc at `centre` lets the robot stand at every corner of the tour.
  [[nodiscard]] bool is_clear_of_tour(Point2 centre, double radius_m) const;

  /// Adds a lamp, see `PointLight`.
  void add_lamp(Vector3 position, float intensity, float radius_m = 0.4F);
  /// Applies the light of the variation and checks the scene.
  [[nodiscard]] Scene finish();

 private:
  Mesh& get_or_create_mesh(const std::string& object, int material);

  SceneVariation variation_;
  Random random_;
  Random moved_;
  Palette palette_;
  Scene scene_;
};

}  // namespace panonav::simulation
