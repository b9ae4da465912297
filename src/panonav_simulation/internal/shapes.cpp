#include "panonav_simulation/internal/shapes.hpp"

#include <cmath>
#include <numbers>

namespace panonav::simulation {

namespace {

// Sectors of round shapes: steps of 10 degrees are accurate to 4 mm at a radius of 1 m.
constexpr int sectors = 36;

void add_quad(Mesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

// A ring of a surface of revolution; its first vertex is repeated at the end, for the texture's
// seam.
struct Ring {
  double radius;
  double z;
};
Mesh make_surface_of_revolution(const std::vector<Ring>& rings) {
  Mesh mesh;
  const auto last = static_cast<double>(rings.size() - 1);
  for (std::size_t r = 0; r < rings.size(); ++r) {
    for (int s = 0; s <= sectors; ++s) {
      const double angle = 2.0 * std::numbers::pi * (s % sectors) / sectors;
      mesh.vertices.push_back(
          {rings[r].radius * std::cos(angle), rings[r].radius * std::sin(angle), rings[r].z});
      mesh.texture_coordinates.push_back({static_cast<float>(s) / static_cast<float>(sectors),
                                          static_cast<float>(static_cast<double>(r) / last)});
    }
  }
  constexpr std::uint32_t width = sectors + 1;
  for (std::uint32_t r = 0; r + 1 < rings.size(); ++r) {
    for (std::uint32_t s = 0; s < sectors; ++s) {
      const std::uint32_t a = r * width + s;
      add_quad(mesh, a, a + 1, a + width + 1, a + width);
    }
  }
  return mesh;
}

}  // namespace

Mesh make_box_mesh(const Vector3& size_m) {
  Mesh mesh;
  const double x = 0.5 * size_m.x_m;
  const double y = 0.5 * size_m.y_m;
  const double z = 0.5 * size_m.z_m;
  // Corners of each face: lower left, lower right, upper right, upper left, viewed from outside.
  const std::array<std::array<Vector3, 4>, 6> faces{{
      {{{-x, -y, -z}, {x, -y, -z}, {x, -y, z}, {-x, -y, z}}},
      {{{x, y, -z}, {-x, y, -z}, {-x, y, z}, {x, y, z}}},
      {{{-x, y, -z}, {-x, -y, -z}, {-x, -y, z}, {-x, y, z}}},
      {{{x, -y, -z}, {x, y, -z}, {x, y, z}, {x, -y, z}}},
      {{{-x, -y, z}, {x, -y, z}, {x, y, z}, {-x, y, z}}},
      {{{-x, y, -z}, {x, y, -z}, {x, -y, -z}, {-x, -y, -z}}},
  }};
  for (const auto& face : faces) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), face.begin(), face.end());
    mesh.texture_coordinates.insert(mesh.texture_coordinates.end(),
                                    {{0.0F, 0.0F}, {1.0F, 0.0F}, {1.0F, 1.0F}, {0.0F, 1.0F}});
    add_quad(mesh, first, first + 1, first + 2, first + 3);
  }
  return mesh;
}

Mesh make_cylinder_mesh(double radius_m, double length_m) {
  const double z = 0.5 * length_m;
  return make_surface_of_revolution({{0.0, -z}, {radius_m, -z}, {radius_m, z}, {0.0, z}});
}

Mesh make_ellipsoid_mesh(const Vector3& radii_m) {
  std::vector<Ring> rings;
  for (int i = 0; i <= sectors / 2; ++i) {
    const double polar = std::numbers::pi * (2.0 * i / sectors - 0.5);
    rings.push_back({std::cos(polar), std::sin(polar)});
  }
  Mesh mesh = make_surface_of_revolution(rings);
  for (Vector3& v : mesh.vertices) {
    v = {v.x_m * radii_m.x_m, v.y_m * radii_m.y_m, v.z_m * radii_m.z_m};
  }
  return mesh;
}

Mesh make_capsule_mesh(double radius_m, double length_m) {
  std::vector<Ring> rings;
  for (int i = 0; i <= sectors / 2; ++i) {
    const double polar = std::numbers::pi * (2.0 * i / sectors - 0.5);
    const Ring ring{radius_m * std::cos(polar), radius_m * std::sin(polar)};
    // The equator has two rings, one at each end of the cylinder.
    if (i <= sectors / 4) rings.push_back({ring.radius, ring.z - 0.5 * length_m});
    if (i >= sectors / 4) rings.push_back({ring.radius, ring.z + 0.5 * length_m});
  }
  return make_surface_of_revolution(rings);
}

Mesh make_rectangle_mesh(double size_x_m, double size_y_m) {
  Mesh mesh;
  const double x = 0.5 * size_x_m;
  const double y = 0.5 * size_y_m;
  mesh.vertices = {{-x, -y, 0.0}, {x, -y, 0.0}, {x, y, 0.0}, {-x, y, 0.0}};
  for (const Vector3& v : mesh.vertices) {
    mesh.texture_coordinates.push_back({static_cast<float>(v.x_m), static_cast<float>(v.y_m)});
  }
  add_quad(mesh, 0, 1, 2, 3);
  return mesh;
}

}  // namespace panonav::simulation
