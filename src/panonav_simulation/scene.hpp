#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav_simulation/ground.hpp"

namespace panonav::simulation {

/// A point or vector in the scene, in metres: x east, y north, z up.
struct Vector3 {
  double x_m = 0.0;  ///< east
  double y_m = 0.0;  ///< north
  double z_m = 0.0;  ///< up
  friend bool operator==(const Vector3&, const Vector3&) = default;
};

/// Largest absolute coordinate of anything in a scene, including cameras; beyond it the ray tracer
/// loses its precision.
inline constexpr double scene_reach_m = 1e9;

/// True if all coordinates are finite and at most `scene_reach_m`.
[[nodiscard]] bool is_in_reach(const Vector3& point) noexcept;

/// Appearance of a surface: a colour, multiplied by a texture if there is one. The texture repeats
/// with period 1 in u and v. Texture coordinate (0, 0) is the lower left corner of the picture, u
/// runs to the right and v upwards. Values are linear, 0 .. 1. Surfaces are matt and visible from
/// both sides.
struct Material {
  std::array<float, 3> colour{0.7F, 0.7F, 0.7F};  ///< red, green, blue, linear
  std::shared_ptr<const Image> texture;           ///< null: plain colour
  float emission = 0.0F;  ///< 1: shows its colour independent of the light (sky, lamps)
};

/// Triangles of one material. `texture_coordinates` is empty or has one entry per vertex.
struct Mesh {
  std::string object;             ///< name of the object it is part of ("wall", "desk 3")
  int material = 0;               ///< index among the scene's materials
  std::vector<Vector3> vertices;  ///< corners of the triangles
  std::vector<std::array<float, 2>> texture_coordinates;  ///< u and v per vertex
  /// Vertex indices of each triangle. Surfaces are visible from both sides; the order matters only
  /// for closed ones: counter-clockwise seen from outside encloses a solid (see `FreeSpace`).
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// A lamp. A surface at distance d that faces it gets the light intensity / (d^2 + radius^2), d and
/// radius in metres; a white surface in light 1 has the value 1.
struct PointLight {
  Vector3 position;        ///< in the scene
  float intensity = 1.0F;  ///< light at a distance of 1 m if the radius were 0
  float radius_m = 0.4F;   ///< size of the lamp; limits the light near it
};

/// Light from a distant source: a surface that faces it gets the light `intensity`.
struct DirectionalLight {
  Direction3 towards_light{0.0, 0.0, 1.0};  ///< of any length but 0
  float intensity = 1.0F;                   ///< any finite number
};

/// An axis-aligned rectangle of the floor.
struct FloorArea {
  Point2 low;   ///< the corner of smallest x and y
  Point2 high;  ///< the corner of largest x and y
  friend bool operator==(const FloorArea&, const FloorArea&) = default;
};

/// Returns the distance of a point from the nearest point of the area in metres; 0 inside it.
[[nodiscard]] double distance_to_area_m(const FloorArea& area, Point2 point);

/// A world for the simulated robot. The robot may drive within `floor_low` .. `floor_high`, and
/// there only in the `drivable` areas if any are listed; not where a mesh below its height is
/// within its radius (see `FreeSpace`).
struct Scene {
  std::string name;                                  ///< of the built-in scene or of the file
  std::vector<Material> materials;                   ///< referred to by index in `Mesh::material`
  std::vector<Mesh> meshes;                          ///< everything visible; also the obstacles
  std::vector<PointLight> lights;                    ///< lamps
  std::vector<DirectionalLight> directional_lights;  ///< distant sources, as the sun
  float ambient = 0.5F;  ///< light from all directions; weaker in corners
  std::array<float, 3> background{0.75F, 0.8F, 0.85F};  ///< colour of rays that hit nothing
  Point2 floor_low;                                     ///< smallest x and y of the robot's floor
  Point2 floor_high;                                    ///< largest x and y of the robot's floor
  std::shared_ptr<const Ground> ground;  ///< what robots follow; null: level at one height
  std::vector<FloorArea> drivable;       ///< empty: the whole floor
  std::vector<Point2> tour;              ///< a closed round trip through free space; may be empty
  double robot_radius_m = 0.2;           ///< of the robot for which the scene is made
  double camera_height_m = 0.6;          ///< of the robot for which the scene is made
  std::vector<std::string> warnings;     ///< e.g. missing textures; shown once by the command
};

/// Throws ContractError, which names the mesh and its fault: an index out of range, not as many
/// texture coordinates as vertices, or a coordinate that is not finite or out of reach. Lights
/// out of range throw, too.
void validate(const Scene& scene);
using panonav::validate;  // for options

/// Moves everything in the scene up by `height_m`, lamps and ground as well.
void raise_scene(Scene& scene, double height_m);

/// Scales all light by `factor`, > 0: lamps, distant and ambient light, emission and the
/// background. The radiance of every pixel is multiplied by `factor`.
void scale_light(Scene& scene, double factor);

}  // namespace panonav::simulation
