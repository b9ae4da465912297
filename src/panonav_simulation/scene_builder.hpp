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

/// Pose of a piece of furniture: its centre on the floor and its yaw.
struct Footing {
  Point2 centre;          ///< in the scene
  double turn_rad = 0.0;  ///< counter-clockwise as viewed from above
};

/// Colours of the furniture of a scene. Pieces of one kind have similar colours, as if from one
/// supplier, so that a view has large dark and bright parts and not only small ones.
struct Palette {
  Colour wood;   ///< of desks and shelves
  Colour paint;  ///< of drawers and cabinets
  Colour cloth;  ///< of chairs
  Colour metal;  ///< of legs
};

/// Builds a built-in scene. It uses two random streams, one for the scene and one for the moved
/// objects, so that moving objects changes nothing else.
class SceneBuilder {
 public:
  /// Starts an empty scene and draws the colours of the palette.
  SceneBuilder(std::string name, const SceneVariation& variation);

  [[nodiscard]] Random& random() noexcept { return random_; }  ///< random stream of the scene
  /// Returns the scene built so far, to add what the functions below cannot make.
  [[nodiscard]] Scene& scene() noexcept { return scene_; }
  /// Returns the palette drawn at construction.
  [[nodiscard]] const Palette& palette() const noexcept { return palette_; }

  /// Adds a material of one colour; returns its index. `emission` as of `Material`.
  int add_plain_material(Colour colour, float emission = 0.0F);
  /// Adds a material with a texture; returns its index.
  int add_textured_material(Image image, float emission = 0.0F);

  /// Adds a flat quadrilateral with corners a b c d. The lower edge of the texture is on a b; the
  /// texture repeats `repeat_u` by `repeat_v` times.
  void add_quadrilateral(const std::string& object, int material, Vector3 a, Vector3 b, Vector3 c,
                         Vector3 d, double repeat_u = 1.0, double repeat_v = 1.0);

  /// Adds a box of `size` whose bottom centre is at `at` in the frame of `footing`. The texture of
  /// the side faces repeats every `tile_m` metres; with 0 each face shows it once.
  void add_box(const std::string& object, int sides, int top, const Footing& footing, Vector3 at,
               Vector3 size, double tile_m = 0.0);

  /// Adds an upright cylinder or truncated cone, closed at the top; its radius at the bottom is
  /// `bottom_radius_factor` times that at the top.
  void add_cylinder(const std::string& object, int material, Point2 centre, double bottom_m,
                    double top_m, double radius_m, int facets = 16,
                    double bottom_radius_factor = 1.0);

  /// Adds an ellipsoid with random dents and bumps, for tree crowns and bushes. `roughness` is the
  /// relative standard deviation of its radius.
  void add_blob(const std::string& object, int material, Vector3 centre, Vector3 radii,
                double roughness);

  /// Adds a wall from `from` to `to`, visible from both sides, with the texture repeating every
  /// `tile_m`.
  void add_wall(const std::string& object, int material, Point2 from, Point2 to, double height_m,
                double tile_m, double bottom_m = 0.0);

  /// Adds a picture, window or door on the wall from `from` to `to`. It begins `along_m` from the
  /// start of the wall and is `before_m` in front of it on the left-hand side.
  void add_on_wall(const std::string& object, int material, Point2 from, Point2 to, double along_m,
                   double width_m, double bottom_m, double top_m, double before_m = 0.01);

  /// Adds a level rectangle with the texture repeating every `tile_m`, as object "floor".
  void add_floor(int material, Point2 low, Point2 high, double tile_m, double height_m = 0.0);
  /// Adds a level rectangle `height_m` above the floor that faces down, as object "ceiling".
  void add_ceiling(int material, Point2 low, Point2 high, double height_m, double tile_m);

  /// Returns the footing of a movable object that is planned at `planned` and covers a disc of
  /// `radius_m`. With the variation's probability it is moved by up to four robot radii, but never
  /// into a drivable area, onto a corner of the tour or out of the area `room`.
  Footing place_movable(const Footing& planned, double radius_m, const FloorArea& room);

  /// True if a disc at `centre` leaves the robot enough space at every corner of the tour.
  [[nodiscard]] bool is_clear_of_tour(Point2 centre, double radius_m) const;

  /// Adds a lamp, see `PointLight`.
  void add_lamp(Vector3 position, float intensity, float radius_m = 0.4F);
  /// Applies the light of the variation, validates the scene and returns it.
  [[nodiscard]] Scene finish();

 private:
  Mesh& get_or_create_mesh(const std::string& object, int material);

  SceneVariation variation_;
  Random random_;
  Random moved_random_;
  Palette palette_;
  Scene scene_;
};

}  // namespace panonav::simulation
