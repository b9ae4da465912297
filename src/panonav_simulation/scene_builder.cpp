#include "panonav_simulation/scene_builder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace panonav::simulation {

namespace {

// Returns the distance of a point from an area; 0 if it is inside.
bool is_inside(const FloorArea& area, Point2 centre, double margin_m) {
  return centre.x_m >= area.low.x_m + margin_m && centre.x_m <= area.high.x_m - margin_m &&
         centre.y_m >= area.low.y_m + margin_m && centre.y_m <= area.high.y_m - margin_m;
}

}  // namespace

SceneBuilder::SceneBuilder(std::string name, const SceneVariation& variation)
    : variation_(variation), random_(variation.seed, 11), moved_random_(variation.moved_seed, 12) {
  scene_.name = std::move(name);
  palette_ = {sample_colour(random_, 0.25, 0.7, 0.2), sample_colour(random_, 0.3, 0.8, 0.12),
              sample_colour(random_, 0.08, 0.45, 0.35), sample_colour(random_, 0.08, 0.35, 0.05)};
}

int SceneBuilder::add_plain_material(Colour colour, float emission) {
  scene_.materials.push_back({colour, nullptr, emission});
  return static_cast<int>(scene_.materials.size()) - 1;
}

int SceneBuilder::add_textured_material(Image image, float emission) {
  scene_.materials.push_back(
      {{1.0F, 1.0F, 1.0F}, std::make_shared<const Image>(std::move(image)), emission});
  return static_cast<int>(scene_.materials.size()) - 1;
}

Mesh& SceneBuilder::get_or_create_mesh(const std::string& object, int material) {
  for (auto& mesh : scene_.meshes) {
    if (mesh.object == object && mesh.material == material) return mesh;
  }
  scene_.meshes.push_back({object, material, {}, {}, {}});
  return scene_.meshes.back();
}

void SceneBuilder::add_quadrilateral(const std::string& object, int material, Vector3 a, Vector3 b,
                                     Vector3 c, Vector3 d, double repeat_u, double repeat_v) {
  Mesh& mesh = get_or_create_mesh(object, material);
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto u = static_cast<float>(repeat_u);
  const auto v = static_cast<float>(repeat_v);
  for (const Vector3& corner : {a, b, c, d}) mesh.vertices.push_back(corner);
  for (const std::array<float, 2>& st :
       {std::array{0.0F, 0.0F}, std::array{u, 0.0F}, std::array{u, v}, std::array{0.0F, v}}) {
    mesh.texture_coordinates.push_back(st);
  }
  mesh.triangles.push_back({base, base + 1, base + 2});
  mesh.triangles.push_back({base, base + 2, base + 3});
}

void SceneBuilder::add_box(const std::string& object, int sides, int top, const Footing& footing,
                           Vector3 at, Vector3 size, double tile_m) {
  const double c = std::cos(footing.turn_rad);
  const double s = std::sin(footing.turn_rad);
  const auto corner = [&](double x, double y, double z) {
    return Vector3{footing.centre.x_m + c * x - s * y, footing.centre.y_m + s * x + c * y, z};
  };
  const double x0 = at.x_m - 0.5 * size.x_m;
  const double x1 = at.x_m + 0.5 * size.x_m;
  const double y0 = at.y_m - 0.5 * size.y_m;
  const double y1 = at.y_m + 0.5 * size.y_m;
  const double z0 = at.z_m;
  const double z1 = at.z_m + size.z_m;
  const auto copies = [tile_m](double length) { return tile_m > 0.0 ? length / tile_m : 1.0; };
  const double nx = copies(size.x_m);
  const double ny = copies(size.y_m);
  const double nz = copies(size.z_m);
  add_quadrilateral(object, sides, corner(x0, y0, z0), corner(x1, y0, z0), corner(x1, y0, z1),
                    corner(x0, y0, z1), nx, nz);
  add_quadrilateral(object, sides, corner(x1, y0, z0), corner(x1, y1, z0), corner(x1, y1, z1),
                    corner(x1, y0, z1), ny, nz);
  add_quadrilateral(object, sides, corner(x1, y1, z0), corner(x0, y1, z0), corner(x0, y1, z1),
                    corner(x1, y1, z1), nx, nz);
  add_quadrilateral(object, sides, corner(x0, y1, z0), corner(x0, y0, z0), corner(x0, y0, z1),
                    corner(x0, y1, z1), ny, nz);
  add_quadrilateral(object, top, corner(x0, y0, z1), corner(x1, y0, z1), corner(x1, y1, z1),
                    corner(x0, y1, z1), nx, ny);
  add_quadrilateral(object, top, corner(x0, y1, z0), corner(x1, y1, z0), corner(x1, y0, z0),
                    corner(x0, y0, z0), nx, ny);
}

void SceneBuilder::add_cylinder(const std::string& object, int material, Point2 centre,
                                double bottom_m, double top_m, double radius_m, int facets,
                                double bottom_radius_factor) {
  const auto rim = [&](int i, double z, double r) {
    const double angle = 2.0 * std::numbers::pi * i / facets;
    return Vector3{centre.x_m + r * std::cos(angle), centre.y_m + r * std::sin(angle), z};
  };
  const double lower = radius_m * bottom_radius_factor;
  for (int i = 0; i < facets; ++i) {
    Mesh& mesh = get_or_create_mesh(object, material);
    const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {rim(i, bottom_m, lower), rim(i + 1, bottom_m, lower),
                                               rim(i + 1, top_m, radius_m), rim(i, top_m, radius_m),
                                               Vector3{centre.x_m, centre.y_m, top_m}});
    const float s0 = static_cast<float>(i) / static_cast<float>(facets);
    const float s1 = static_cast<float>(i + 1) / static_cast<float>(facets);
    mesh.texture_coordinates.insert(
        mesh.texture_coordinates.end(),
        {{s0, 0.0F}, {s1, 0.0F}, {s1, 1.0F}, {s0, 1.0F}, {0.5F * (s0 + s1), 1.0F}});
    mesh.triangles.push_back({base, base + 1, base + 2});
    mesh.triangles.push_back({base, base + 2, base + 3});
    mesh.triangles.push_back({base + 3, base + 2, base + 4});
  }
}

void SceneBuilder::add_blob(const std::string& object, int material, Vector3 centre, Vector3 radii,
                            double roughness) {
  constexpr int blob_facets = 10;
  constexpr int blob_rings = 6;
  Mesh& mesh = get_or_create_mesh(object, material);
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int ring = 0; ring <= blob_rings; ++ring) {
    const double elevation = std::numbers::pi * (static_cast<double>(ring) / blob_rings - 0.5);
    double first = 1.0;
    for (int i = 0; i <= blob_facets; ++i) {
      const double bump = std::max(0.3, random_.normal(1.0, roughness));
      if (i == 0) first = bump;
      // The last column equals the first, so that the seam closes; each pole is a single point.
      const double r = ring == 0 || ring == blob_rings ? 1.0 : i == blob_facets ? first : bump;
      const double angle = 2.0 * std::numbers::pi * i / blob_facets;
      mesh.vertices.push_back({centre.x_m + radii.x_m * r * std::cos(elevation) * std::cos(angle),
                               centre.y_m + radii.y_m * r * std::cos(elevation) * std::sin(angle),
                               centre.z_m + radii.z_m * r * std::sin(elevation)});
      mesh.texture_coordinates.push_back(
          {2.0F * static_cast<float>(i) / blob_facets, static_cast<float>(ring) / blob_rings});
    }
  }
  for (int ring = 0; ring < blob_rings; ++ring) {
    for (int i = 0; i < blob_facets; ++i) {
      const std::uint32_t a = base + static_cast<std::uint32_t>(ring * (blob_facets + 1) + i);
      const std::uint32_t b = a + blob_facets + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  }
}

void SceneBuilder::add_wall(const std::string& object, int material, Point2 from, Point2 to,
                            double height_m, double tile_m, double bottom_m) {
  add_quadrilateral(object, material, {from.x_m, from.y_m, bottom_m}, {to.x_m, to.y_m, bottom_m},
                    {to.x_m, to.y_m, height_m}, {from.x_m, from.y_m, height_m},
                    distance(from, to) / tile_m, (height_m - bottom_m) / tile_m);
}

void SceneBuilder::add_on_wall(const std::string& object, int material, Point2 from, Point2 to,
                               double along_m, double width_m, double bottom_m, double top_m,
                               double before_m) {
  const double length = distance(from, to);
  const double ux = (to.x_m - from.x_m) / length;
  const double uy = (to.y_m - from.y_m) / length;
  const auto corner = [&](double along, double z) {
    return Vector3{from.x_m + ux * along - uy * before_m, from.y_m + uy * along + ux * before_m, z};
  };
  // Viewed from its left-hand side, the wall runs from right to left.
  add_quadrilateral(object, material, corner(along_m + width_m, bottom_m),
                    corner(along_m, bottom_m), corner(along_m, top_m),
                    corner(along_m + width_m, top_m));
}

void SceneBuilder::add_floor(int material, Point2 low, Point2 high, double tile_m,
                             double height_m) {
  add_quadrilateral("floor", material, {low.x_m, low.y_m, height_m}, {high.x_m, low.y_m, height_m},
                    {high.x_m, high.y_m, height_m}, {low.x_m, high.y_m, height_m},
                    (high.x_m - low.x_m) / tile_m, (high.y_m - low.y_m) / tile_m);
}

void SceneBuilder::add_ceiling(int material, Point2 low, Point2 high, double height_m,
                               double tile_m) {
  add_quadrilateral("ceiling", material, {low.x_m, high.y_m, height_m},
                    {high.x_m, high.y_m, height_m}, {high.x_m, low.y_m, height_m},
                    {low.x_m, low.y_m, height_m}, (high.x_m - low.x_m) / tile_m,
                    (high.y_m - low.y_m) / tile_m);
}

Footing SceneBuilder::place_movable(const Footing& planned, double radius_m,
                                    const FloorArea& room) {
  // Draw the same random numbers for every object, so that one object's motion does not change
  // that of the next.
  const bool moves = moved_random_.uniform() < variation_.moved_objects;
  Footing found = planned;
  bool placed = false;
  for (int attempt = 0; attempt < 40; ++attempt) {
    const double angle = moved_random_.uniform(-std::numbers::pi, std::numbers::pi);
    const double step = moved_random_.uniform(1.5, 4.0) * scene_.robot_radius_m;
    const double turn = moved_random_.uniform(-0.6, 0.6);
    if (!moves || placed) continue;
    const Point2 centre{planned.centre.x_m + step * std::cos(angle),
                        planned.centre.y_m + step * std::sin(angle)};
    bool is_free = is_inside(room, centre, 0.5 * radius_m);
    for (const auto& area : scene_.drivable)
      is_free = is_free && distance_to_area_m(area, centre) >= radius_m;
    is_free = is_free && is_clear_of_tour(centre, radius_m);
    if (is_free) {
      found = {centre, planned.turn_rad + turn};
      placed = true;
    }
  }
  return found;
}

bool SceneBuilder::is_clear_of_tour(Point2 centre, double radius_m) const {
  return std::ranges::all_of(scene_.tour, [&](Point2 corner) {
    return distance(corner, centre) >= radius_m + 1.5 * scene_.robot_radius_m;
  });
}

void SceneBuilder::add_lamp(Vector3 position, float intensity, float radius_m) {
  scene_.lights.push_back({position, intensity, radius_m});
}

Scene SceneBuilder::finish() {
  scale_light(scene_, variation_.light);
  validate(scene_);
  return std::move(scene_);
}

}  // namespace panonav::simulation
