#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav::simulation {

/// A point or vector of the scene in metres: x east, y north, z up.
struct Vector3 {
  double x_m = 0.0;  ///< east
  double y_m = 0.0;  ///< north
  double z_m = 0.0;  ///< up
  friend bool operator==(const Vector3&, const Vector3&) = default;
};

/// Largest distance from the origin of anything in a scene, the camera too: beyond it the ray
/// tracer loses its precision.
inline constexpr double scene_reach_m = 1e9;

/// True if all coordinates are numbers within `scene_reach_m`.
[[nodiscard]] bool is_in_reach(const Vector3& point) noexcept;

/// Appearance of a surface: a colour times, where there is one, a texture that repeats every
/// texture coordinate of 1. Texture coordinate (0, 0) is the lower left corner of the picture, u
/// runs to the right and v upwards. Linear 0 .. 1; matt, seen from both sides.
struct Material {
  std::array<float, 3> colour{0.7F, 0.7F, 0.7F};  ///< red, green, blue, linear
  std::shared_ptr<const Image> texture;           ///< null: plain colour
  float emission = 0.0F;  ///< 1: shows its colour whatever the light (sky, lamps)
};

/// Triangles of one material. `texture_coordinates` is empty or has one entry per vertex.
struct Mesh {
  std::string object;             ///< which object of the scene it belongs to ("wall", "desk 3")
  int material = 0;               ///< its number among the scene's materials
  std::vector<Vector3> vertices;  ///< the corners of its triangles
  std::vector<std::array<float, 2>> texture_coordinates;  ///< u and v of each vertex
  /// Numbers of their vertices; surfaces are seen from both sides, so the order does not count.
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// A lamp. A surface at distance d that faces it gets the light intensity / (d^2 + radius^2), in
/// metres; a white surface in light 1 has the value 1.
struct PointLight {
  Vector3 position;        ///< in the scene
  float intensity = 1.0F;  ///< light at a distance of 1 m, but for its own size
  float radius_m = 0.4F;   ///< of the lamp itself: near it, light does not grow without bound
};

/// Light from far away: a surface that faces it gets the light `intensity`.
struct DirectionalLight {
  Direction3 towards_light{0.0, 0.0, 1.0};  ///< of any length but 0
  float intensity = 1.0F;                   ///< any finite number
};

/// An axis-aligned rectangle of the floor.
struct FloorArea {
  Point2 low;   ///< the corner of least x and y
  Point2 high;  ///< the corner of largest x and y
  friend bool operator==(const FloorArea&, const FloorArea&) = default;
};

/// Returns the distance of a point from the nearest point of the area in metres; 0 inside it.
[[nodiscard]] double distance_to_area_m(const FloorArea& area, Point2 point);

/// A world for the simulated robot. The robot may drive in `floor_low` .. `floor_high`, and there
/// only in the `drivable` areas if there are any, less the places where a mesh below the robot's
/// height stands within its radius (see `FreeSpace`).
struct Scene {
  std::string name;                 ///< of the built-in scene or of the file
  std::vector<Material> materials;  ///< meshes name them by their number
  std::vector<Mesh> meshes;         ///< everything that can be seen or driven against
  std::vector<PointLight> lights;   ///< lamps
  std::vector<DirectionalLight> directional_lights;  ///< from far away, as of the sun
  float ambient = 0.5F;  ///< light that comes from everywhere; less of it reaches corners
  std::array<float, 3> background{0.75F, 0.8F, 0.85F};  ///< what a ray sees that hits nothing
  Point2 floor_low;                   ///< corner of least x and y of where the robot may drive
  Point2 floor_high;                  ///< corner of largest x and y of where the robot may drive
  std::vector<FloorArea> drivable;    ///< empty: the whole floor
  std::vector<Point2> tour;           ///< a closed round trip through free space; may be empty
  double robot_radius_m = 0.2;        ///< of the robot that the scene is made for
  double camera_height_m = 0.6;       ///< viewpoint of the robot that the scene is made for
  std::vector<std::string> warnings;  ///< missing textures and the like; shown once by the command
};

/// Throws ContractError that names the mesh and its fault: an index out of range, a number of
/// texture coordinates that is not the number of vertices, a coordinate that is not finite or
/// out of reach.
void validate(const Scene& scene);
using panonav::validate;  // for options

/// Scales all light by `factor`: lamps, far and ambient light, what shines by itself and the
/// background. Every pixel's radiance is then `factor` times what it was. `factor` > 0.
void scale_light(Scene& scene, double factor);

}  // namespace panonav::simulation
