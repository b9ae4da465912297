#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// A point or vector of the scene in metres: x east, y north, z up.
struct Vector3 {
  double x_m = 0.0;
  double y_m = 0.0;
  double z_m = 0.0;
  friend bool operator==(const Vector3&, const Vector3&) = default;
};

/// How a surface looks: a colour times, where there is one, a texture that repeats every texture
/// coordinate of 1. Linear 0 .. 1.
struct Material {
  std::array<float, 3> colour{0.7F, 0.7F, 0.7F};
  std::shared_ptr<const Image> texture;  ///< null: plain colour
  float emission = 0.0F;                 ///< 1: shows its colour whatever the light (sky, lamps)
};

/// Triangles of one material. `texture_coordinates` is empty or has one entry per vertex.
struct Mesh {
  std::string
      object;  ///< which object of the scene it belongs to, for moving objects ("wall", "desk 3")
  int material = 0;
  std::vector<Vector3> vertices;
  std::vector<std::array<float, 2>> texture_coordinates;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

struct PointLight {
  Vector3 position;
  float intensity = 1.0F;
};

/// A world for the simulated robot. `floor` is what the robot may drive in: an axis-aligned
/// rectangle, less the places where a mesh below the robot's height stands within its radius (see
/// `FreeSpace`).
struct Scene {
  std::string name;
  std::vector<Material> materials;
  std::vector<Mesh> meshes;
  std::vector<PointLight> lights;
  float ambient = 0.5F;  ///< light that comes from everywhere
  Point2 floor_low;
  Point2 floor_high;
  std::vector<std::string> warnings;  ///< missing textures and the like; shown once by the command
};

}  // namespace panonav
