// Outdoor scenes and tables: the garden, the street, and the arena on a table.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "panonav_simulation/furniture.hpp"
#include "panonav_simulation/internal/built_in_scenes.hpp"

namespace panonav::simulation {

namespace {

// Adds a distant dome with sky and clouds, from a little below the horizon up to the zenith.
void add_sky(SceneBuilder& builder, Point2 centre, double radius_m) {
  Mesh mesh;
  mesh.object = "sky";
  mesh.material = builder.add_textured_material(sky_texture(builder.random(), 512, 256), 1.0F);
  constexpr int facets = 48;
  constexpr int rings = 16;
  constexpr double lowest_elevation_rad = -0.05;
  for (int ring = 0; ring <= rings; ++ring) {
    const double share = static_cast<double>(ring) / rings;
    const double elevation =
        lowest_elevation_rad + share * (0.5 * std::numbers::pi - lowest_elevation_rad);
    for (int i = 0; i <= facets; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / facets;
      const double ground_radius_m = radius_m * std::cos(elevation);
      mesh.vertices.push_back({centre.x_m + ground_radius_m * std::cos(angle),
                               centre.y_m + ground_radius_m * std::sin(angle),
                               radius_m * std::sin(elevation)});
      mesh.texture_coordinates.push_back(
          {static_cast<float>(i) / facets, static_cast<float>(0.01 + 0.98 * share)});
    }
  }
  for (int ring = 0; ring < rings; ++ring) {
    for (int i = 0; i < facets; ++i) {
      const auto a = static_cast<std::uint32_t>(ring * (facets + 1) + i);
      const std::uint32_t b = a + facets + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  }
  builder.scene().meshes.push_back(std::move(mesh));
}

// Materials of one kind of house.
struct HouseKind {
  int walls = 0;
  int roof = 0;
  int window = 0;
  int door = 0;
};

HouseKind make_house_kind(SceneBuilder& builder, Colour wall_colour, Colour roof_colour) {
  Random& random = builder.random();
  HouseKind kind;
  kind.walls = builder.add_textured_material(
      brick_texture(random, 128, 6, 12, wall_colour,
                    {1.1F * wall_colour[0], 1.1F * wall_colour[1], 1.1F * wall_colour[2]}));
  kind.roof = builder.add_textured_material(
      brick_texture(random, 128, 8, 8, roof_colour,
                    {0.7F * roof_colour[0], 0.7F * roof_colour[1], 0.7F * roof_colour[2]}));
  kind.window = builder.add_textured_material(window_texture(random, 64));
  kind.door = builder.add_textured_material(door_texture(random, 64, {0.35F, 0.22F, 0.15F}));
  return kind;
}

void add_house(SceneBuilder& builder, const std::string& name, const HouseKind& kind,
               const Footing& footing, Vector3 size) {
  const auto [walls, roof, window, door] = kind;
  builder.add_box(name, walls, walls, footing, {0.0, 0.0, 0.0}, size, 0.6 * size.z_m);
  const double c = std::cos(footing.turn_rad);
  const double s = std::sin(footing.turn_rad);
  const auto at = [&](double x, double y, double z) {
    return Vector3{footing.centre.x_m + c * x - s * y, footing.centre.y_m + s * x + c * y, z};
  };
  const double hx = 0.55 * size.x_m;
  const double hy = 0.6 * size.y_m;
  const double z0 = 0.97 * size.z_m;
  const double z1 = 1.5 * size.z_m;
  builder.add_quadrilateral(name, roof, at(-hx, -hy, z0), at(hx, -hy, z0), at(hx, 0.0, z1),
                            at(-hx, 0.0, z1), 3.0, 2.0);
  builder.add_quadrilateral(name, roof, at(hx, hy, z0), at(-hx, hy, z0), at(-hx, 0.0, z1),
                            at(hx, 0.0, z1), 3.0, 2.0);
  for (const double x : {-hx, hx}) {
    builder.add_quadrilateral(name, walls, at(0.9 * x, -hy, z0), at(0.9 * x, hy, z0),
                              at(0.9 * x, 0.0, z1), at(0.9 * x, 0.0, z1));
  }
  const double out = 0.5 * size.y_m * 1.01;
  for (const double side : {-1.0, 1.0}) {
    const double y = side * out;
    const double w = 0.12 * size.x_m * side;
    for (const double x : {-0.3, 0.3}) {
      builder.add_quadrilateral(name, window, at(x * size.x_m + w * -1.0, y, 0.4 * size.z_m),
                                at(x * size.x_m + w, y, 0.4 * size.z_m),
                                at(x * size.x_m + w, y, 0.8 * size.z_m),
                                at(x * size.x_m - w, y, 0.8 * size.z_m));
    }
    builder.add_quadrilateral(name, door, at(-0.8 * w, y, 0.0), at(0.8 * w, y, 0.0),
                              at(0.8 * w, y, 0.7 * size.z_m), at(-0.8 * w, y, 0.7 * size.z_m));
  }
}

void add_hedge(SceneBuilder& builder, const std::string& name, Point2 from, Point2 to,
               double height_m) {
  Random& random = builder.random();
  const float green = static_cast<float>(random.uniform(0.18, 0.36));
  const int leaves = builder.add_textured_material(
      foliage_texture(random, 256, {0.75F * green, green, 0.5F * green}));
  const double length = distance(from, to);
  const double turn = std::atan2(to.y_m - from.y_m, to.x_m - from.x_m);
  // Segments have random heights and depths, so that the hedge is irregular.
  const int segments = std::max(1, static_cast<int>(length / 0.8));
  for (int i = 0; i < segments; ++i) {
    const double share = (i + 0.5) / segments;
    const Footing footing{{from.x_m + share * (to.x_m - from.x_m) + random.normal(0.0, 0.05),
                           from.y_m + share * (to.y_m - from.y_m) + random.normal(0.0, 0.05)},
                          turn};
    builder.add_box(
        name, leaves, leaves, footing, {0.0, 0.0, 0.0},
        {1.05 * length / segments, random.uniform(0.4, 0.7), height_m * random.uniform(0.8, 1.2)},
        1.5);
  }
}

// Adds hedges on all four sides, with gaps through which distant trees are visible.
void add_hedges(SceneBuilder& builder) {
  Random& random = builder.random();
  const std::array<Point2, 4> corners{Point2{-1.5, -1.5}, Point2{13.5, -1.5}, Point2{13.5, 11.5},
                                      Point2{-1.5, 11.5}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Point2 a = corners[i];
    const Point2 b = corners[(i + 1) % 4];
    const double gap = random.uniform(0.3, 0.6);
    const auto along = [&](double t) {
      return Point2{a.x_m + t * (b.x_m - a.x_m), a.y_m + t * (b.y_m - a.y_m)};
    };
    const double height = random.uniform(0.9, 1.8);
    add_hedge(builder, "hedge " + std::to_string(2 * i), a, along(gap), height);
    add_hedge(builder, "hedge " + std::to_string(2 * i + 1), along(gap + 0.18), b, height);
  }
}

// Adds trees and flower boxes at positions clear of the tour.
void add_trees_and_boxes(SceneBuilder& builder, const FloorArea& plot) {
  Random& random = builder.random();
  const auto place = [&](double radius_m) {
    Point2 at;
    do {
      at = {random.uniform(0.0, 12.0), random.uniform(0.0, 10.0)};
    } while (!builder.is_clear_of_tour(at, radius_m));
    return at;
  };
  constexpr double tree_clearance_m = 0.4;
  constexpr double crate_clearance_m = 0.7;
  for (int i = 0; i < 7; ++i) {
    const Footing planned{place(tree_clearance_m), 0.0};
    const double height_m = random.uniform(2.0, 4.5);
    const TreeKind kind = make_tree_kind(builder);
    add_tree(builder, "tree " + std::to_string(i), kind,
             builder.place_movable(planned, tree_clearance_m, plot).centre, height_m);
  }
  for (int i = 0; i < 5; ++i) {
    const Footing planned{place(crate_clearance_m), random.uniform(-3.0, 3.0)};
    add_crate(builder, "flower box " + std::to_string(i),
              builder.place_movable(planned, crate_clearance_m, plot),
              {random.uniform(0.4, 1.2), random.uniform(0.3, 0.6), random.uniform(0.3, 0.8)});
  }
}

// Adds distant trees of a few kinds, which form the horizon.
void add_far_trees(SceneBuilder& builder, Point2 middle) {
  Random& random = builder.random();
  std::array<TreeKind, 6> kinds;
  for (TreeKind& kind : kinds) kind = make_tree_kind(builder);
  for (int i = 0; i < 60; ++i) {
    const double angle = 2.0 * std::numbers::pi * (i + random.uniform(-0.5, 0.5)) / 60.0;
    const double radius = random.uniform(25.0, 90.0);
    const double height_m = random.uniform(4.0, 12.0);
    const TreeKind& kind = kinds[random.index(kinds.size())];
    add_tree(builder, "far tree " + std::to_string(i), kind,
             {middle.x_m + radius * std::cos(angle), middle.y_m + radius * std::sin(angle)},
             height_m);
  }
}

}  // namespace

Scene make_garden(const SceneVariation& variation) {
  SceneBuilder builder("garden", variation);
  Scene& scene = builder.scene();
  Random& random = builder.random();
  scene.floor_low = {0.0, 0.0};
  scene.floor_high = {12.0, 10.0};
  scene.ambient = 0.7F;
  const double azimuth = random.uniform(-std::numbers::pi, std::numbers::pi);
  scene.directional_lights.push_back({Direction3::from_angles(azimuth, 0.8), 0.8F});
  const Point2 middle{6.0, 5.0};
  add_sky(builder, middle, 150.0);
  const int grass =
      builder.add_textured_material(noise_texture(random, 256, {0.25F, 0.36F, 0.16F}, 0.2, 1.4));
  builder.add_floor(grass, {-160.0, -160.0}, {160.0, 160.0}, 3.0);
  const int gravel =
      builder.add_textured_material(noise_texture(random, 256, {0.55F, 0.5F, 0.42F}, 0.15, 1.0));
  builder.add_floor(gravel, {4.8, -1.0}, {6.4, 11.0}, 2.0, 0.01);

  add_hedges(builder);
  const FloorArea plot{{-1.0, -1.0}, {13.0, 11.0}};
  scene.tour = {{1.0, 1.0}, {11.0, 1.0}, {11.0, 9.0}, {1.0, 9.0}};
  add_trees_and_boxes(builder, plot);
  const Colour plaster = sample_colour(random, 0.4, 0.8, 0.2);
  const Footing house{{random.uniform(2.0, 10.0), 18.0}, random.uniform(-0.2, 0.2)};
  add_house(builder, "house", make_house_kind(builder, plaster, {0.5F, 0.25F, 0.2F}), house,
            {9.0, 6.0, 3.2});
  const Colour tar = sample_colour(random, 0.15, 0.4, 0.2);
  const Footing shed{{-5.0, random.uniform(2.0, 8.0)}, random.uniform(1.2, 1.9)};
  add_house(builder, "shed", make_house_kind(builder, builder.palette().wood, tar), shed,
            {3.0, 2.2, 2.0});
  add_far_trees(builder, middle);
  return builder.finish();
}

namespace {

constexpr double street_length_m = 620.0;
constexpr double roadway_m = 9.0;

// Adds a parked car: a body with a cabin on it, beside the roadway.
void add_car(SceneBuilder& builder, const std::string& name, int paint, int glass,
             const Footing& footing) {
  builder.add_box(name, paint, paint, footing, {0.0, 0.0, 0.2}, {4.1, 1.7, 0.65});
  builder.add_box(name, glass, paint, footing, {-0.2, 0.0, 0.85}, {2.2, 1.5, 0.55});
}

// Kinds of houses, trees and cars along a street; each plot has one of them.
struct StreetKinds {
  std::array<HouseKind, 10> houses;
  std::array<TreeKind, 5> trees;
  std::array<int, 6> paints{};
  int glass = 0;
};

StreetKinds make_street_kinds(SceneBuilder& builder) {
  Random& random = builder.random();
  StreetKinds kinds;
  for (HouseKind& kind : kinds.houses) {
    const Colour walls = sample_colour(random, 0.2, 0.85, 0.2);
    const Colour roof = sample_colour(random, 0.15, 0.5, 0.3);
    kind = make_house_kind(builder, walls, roof);
  }
  for (TreeKind& kind : kinds.trees) kind = make_tree_kind(builder);
  for (int& paint : kinds.paints) {
    paint = builder.add_plain_material(sample_colour(random, 0.05, 0.9, 0.4));
  }
  kinds.glass = builder.add_plain_material({0.12F, 0.14F, 0.16F});
  return kinds;
}

// Adds the plots of one side: houses of random kinds and widths behind front gardens, with gaps,
// trees, hedges, and cars at the kerb. `side` is 1 in the north of the roadway and -1 in the south.
void add_plots(SceneBuilder& builder, const StreetKinds& kinds, double side) {
  Random& random = builder.random();
  const double kerb_m = side > 0.0 ? roadway_m : 0.0;
  const FloorArea kerbs{{-10.0, -4.0}, {street_length_m + 10.0, roadway_m + 4.0}};
  double along_m = -20.0;
  for (int number = 0; along_m < street_length_m + 20.0; ++number) {
    const std::string plot = (side > 0.0 ? "north " : "south ") + std::to_string(number);
    const Vector3 size{random.uniform(7.0, 14.0), random.uniform(7.0, 10.0),
                       random.uniform(3.0, 8.0)};
    const double width_m = size.x_m + random.uniform(3.0, 7.0);
    const double middle_m = along_m + 0.5 * width_m;
    const double front_m = random.uniform(4.5, 9.0);
    add_house(builder, plot + " house", kinds.houses[random.index(kinds.houses.size())],
              {{middle_m, kerb_m + side * (front_m + 0.5 * size.y_m)}, random.normal(0.0, 0.05)},
              size);
    if (random.uniform() < 0.6) {
      add_tree(builder, plot + " tree", kinds.trees[random.index(kinds.trees.size())],
               {along_m + random.uniform(0.0, 2.0), kerb_m + side * random.uniform(2.6, 4.0)},
               random.uniform(3.5, 9.0));
    }
    if (random.uniform() < 0.5) {
      builder.add_box(plot + " hedge", kinds.trees[0].leaves, kinds.trees[0].leaves,
                      {{middle_m, kerb_m + side * 3.0}, 0.0}, {0.0, 0.0, 0.0},
                      {random.uniform(3.0, size.x_m), 0.6, random.uniform(0.7, 1.6)}, 1.5);
    }
    if (random.uniform() < 0.6) {
      constexpr double car_radius_m = 2.1;
      const Footing kerb{{middle_m + random.uniform(-2.0, 2.0), kerb_m + side * 1.1}, 0.0};
      Footing parked = builder.place_movable(kerb, car_radius_m, kerbs);
      // A car stands along the kerb on every day.
      parked = {{parked.centre.x_m, kerb.centre.y_m}, 0.0};
      add_car(builder, plot + " car", kinds.paints[random.index(kinds.paints.size())], kinds.glass,
              parked);
    }
    along_m += width_m;
  }
}

}  // namespace

Scene make_street(const SceneVariation& variation) {
  SceneBuilder builder("street", variation);
  Scene& scene = builder.scene();
  Random& random = builder.random();
  scene.floor_low = {0.0, 0.0};
  scene.floor_high = {street_length_m, roadway_m};
  scene.robot_radius_m = 0.4;
  scene.camera_height_m = 1.0;
  scene.ambient = 0.6F;
  scene.tour = {{5.0, 2.0}, {105.0, 2.0}, {105.0, 7.0}, {5.0, 7.0}};
  const double azimuth = random.uniform(-std::numbers::pi, std::numbers::pi);
  scene.directional_lights.push_back({Direction3::from_angles(azimuth, 0.8), 0.7F});
  const Point2 middle{0.5 * street_length_m, 0.5 * roadway_m};
  constexpr double far_m = 900.0;
  add_sky(builder, middle, far_m);
  const int grass =
      builder.add_textured_material(noise_texture(random, 256, {0.25F, 0.36F, 0.16F}, 0.2, 1.4));
  builder.add_floor(grass, {middle.x_m - far_m, -far_m}, {middle.x_m + far_m, far_m}, 4.0, -0.02);
  const int tar =
      builder.add_textured_material(noise_texture(random, 256, {0.3F, 0.3F, 0.31F}, 0.15, 1.2));
  builder.add_floor(tar, {-60.0, 0.0}, {street_length_m + 60.0, roadway_m}, 5.0);
  const int paving = builder.add_textured_material(
      brick_texture(random, 128, 4, 4, {0.55F, 0.53F, 0.5F}, {0.35F, 0.34F, 0.33F}));
  for (const double kerb_m : {-2.2, roadway_m}) {
    builder.add_floor(paving, {-60.0, kerb_m}, {street_length_m + 60.0, kerb_m + 2.2}, 2.0, 0.01);
  }
  const StreetKinds kinds = make_street_kinds(builder);
  for (const double side : {1.0, -1.0}) add_plots(builder, kinds, side);
  return builder.finish();
}

Scene make_arena(const SceneVariation& variation) {
  SceneBuilder builder("arena", variation);
  Scene& scene = builder.scene();
  Random& random = builder.random();
  scene.floor_low = {0.0, 0.0};
  scene.floor_high = {1.4, 1.2};
  scene.camera_height_m = 0.08;
  scene.robot_radius_m = 0.0275;
  scene.ambient = 0.5F;
  const int table =
      builder.add_textured_material(noise_texture(random, 128, {0.55F, 0.55F, 0.5F}, 0.06));
  // The table is 2 mm above the floor of the lab, because coinciding surfaces would flicker.
  builder.add_floor(table, {-0.04, -0.04}, {1.44, 1.24}, 0.4, 0.002);
  // The lab around the table is visible above the houses.
  const FloorArea lab{{-2.0, -2.0}, {3.4, 3.2}};
  furnish_room_shell(builder, lab, 2.2);
  // One lamp is at the side, so that houses have a bright and a dark face.
  builder.add_lamp({random.uniform(-1.5, -0.5), random.uniform(-1.5, 2.7), 1.9}, 2.5F);
  builder.add_lamp({0.7, 0.6, 2.0}, 0.5F);

  // A low painted wall around the town has dark and bright parts.
  const std::array<Point2, 4> wall{Point2{-0.04, -0.04}, Point2{1.44, -0.04}, Point2{1.44, 1.24},
                                   Point2{-0.04, 1.24}};
  for (std::size_t i = 0; i < 4; ++i) {
    builder.add_wall("border " + std::to_string(i),
                     builder.add_textured_material(noise_texture(
                         random, 128, sample_colour(random, 0.2, 0.75, 0.15), 0.35, 3.0)),
                     wall[i], wall[(i + 1) % 4], 0.16, 1.0);
  }
  // The town has two rows of three blocks, with streets at least 20 cm wide, and one or two houses
  // per block.
  const FloorArea plot{{0.0, 0.0}, {1.4, 1.2}};
  int number = 0;
  for (const double y : {0.38, 0.82}) {
    for (const double x : {0.3, 0.7, 1.1}) {
      const Colour paint = sample_colour(random, 0.15, 0.85, 0.3);
      const Colour tiles = sample_colour(random, 0.15, 0.5, 0.4);
      const Footing block{
          {x + random.normal(0.0, 0.015), y + random.normal(0.0, 0.015)},
          random.uniform() < 0.5 ? random.normal(0.0, 0.12) : 1.57 + random.normal(0.0, 0.12)};
      const Footing footing = builder.place_movable(block, 0.1, plot);
      const bool has_two_houses = random.uniform() < 0.4;
      const double length = has_two_houses ? 0.085 : random.uniform(0.12, 0.18);
      for (const double side : has_two_houses ? std::array{-0.05, 0.05} : std::array{0.0, 0.0}) {
        const Footing place{{footing.centre.x_m + side * std::cos(footing.turn_rad),
                             footing.centre.y_m + side * std::sin(footing.turn_rad)},
                            footing.turn_rad};
        const Colour plaster = vary_colour(random, paint);
        const Vector3 size{length, random.uniform(0.09, 0.14), random.uniform(0.1, 0.17)};
        add_house(builder, "house " + std::to_string(number++),
                  make_house_kind(builder, plaster, tiles), place, size);
        if (!has_two_houses) break;
      }
    }
  }
  scene.tour = {{0.1, 0.12}, {1.3, 0.12}, {1.3, 1.08}, {0.1, 1.08}};
  return builder.finish();
}

}  // namespace panonav::simulation
