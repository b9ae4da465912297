// Scenes that consist of one room: office, lab, hall and industrial hall.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "panonav_simulation/furniture.hpp"
#include "panonav_simulation/internal/built_in_scenes.hpp"

namespace panonav::simulation {

namespace {

constexpr double quarter_turn_rad = 0.5 * std::numbers::pi;

// Values of `kind` in `furnish_row` that select a desk and a shelf.
constexpr double desk_kind = 0.15;
constexpr double shelf_kind = 0.6;

// Adds a row of furniture along a straight line, in random order and spacing, facing `turn_rad`.
// The first piece is of `first_kind` if it has a value.
void furnish_row(SceneBuilder& builder, const FloorArea& room, const std::string& name, Point2 from,
                 Point2 to, double turn_rad, std::optional<double> first_kind) {
  Random& random = builder.random();
  const double length = distance(from, to);
  const double ux = (to.x_m - from.x_m) / length;
  const double uy = (to.y_m - from.y_m) / length;
  double along = random.uniform(0.2, 0.5);
  int number = 0;
  double kind = random.uniform();
  while (along < length - 0.3) {
    // The next piece often has the same kind as the last one.
    if (random.uniform() < 0.35) kind = random.uniform();
    if (number == 0 && first_kind) kind = *first_kind;
    const bool is_desk = kind < 0.3;
    const bool is_wardrobe = !is_desk && kind < 0.5;
    const bool is_shelf = kind >= 0.5 && kind < 0.67;
    const double width = is_desk       ? 1.5
                         : is_wardrobe ? random.uniform(1.1, 2.2)
                         : is_shelf    ? 1.0
                                       : 0.7;
    const Point2 at{from.x_m + ux * (along + 0.5 * width), from.y_m + uy * (along + 0.5 * width)};
    const std::string piece = name + " " + std::to_string(number++);
    const Footing planned{at, turn_rad + random.normal(0.0, 0.05)};
    // Wardrobes are never moved.
    const Footing footing =
        is_wardrobe ? planned : builder.place_movable(planned, 0.5 * width, room);
    if (is_desk) {
      add_desk(builder, piece, footing);
      const Point2 before{footing.centre.x_m + 0.45 * std::sin(footing.turn_rad),
                          footing.centre.y_m - 0.45 * std::cos(footing.turn_rad)};
      add_chair(builder, piece + " chair", {before, random.uniform(-3.0, 3.0)});
    } else if (is_wardrobe) {
      add_wardrobe(builder, piece, footing, width, random.uniform(1.3, 2.1));
    } else if (is_shelf) {
      add_shelf(builder, piece, footing, width - 0.1, random.uniform(1.2, 2.1));
    } else if (kind < 0.82) {
      add_cabinet(builder, piece, footing);
    } else if (kind < 0.9) {
      add_plant(builder, piece, footing.centre);
    } else {
      add_crate(builder, piece, footing,
                {random.uniform(0.3, 0.6), random.uniform(0.3, 0.6), random.uniform(0.3, 1.2)});
    }
    along += width + random.uniform(0.0, 0.5);
  }
}

// Kind of the first piece in the rows along the long walls; nullopt: random.
struct FirstFurnitureKinds {
  std::optional<double> south{};
  std::optional<double> north{};
};

// Adds furniture along all four walls, at a distance of `depth_m`.
void furnish_walls(SceneBuilder& builder, const FloorArea& room, double depth_m,
                   const FirstFurnitureKinds& first_kinds = {}) {
  const Point2 a{room.low.x_m + depth_m, room.low.y_m + depth_m};
  const Point2 b{room.high.x_m - depth_m, room.low.y_m + depth_m};
  const Point2 c{room.high.x_m - depth_m, room.high.y_m - depth_m};
  const Point2 d{room.low.x_m + depth_m, room.high.y_m - depth_m};
  furnish_row(builder, room, "south", a, b, 2.0 * quarter_turn_rad, first_kinds.south);
  furnish_row(builder, room, "east", b, c, -quarter_turn_rad, std::nullopt);
  furnish_row(builder, room, "north", c, d, 0.0, first_kinds.north);
  furnish_row(builder, room, "west", d, a, quarter_turn_rad, std::nullopt);
}

// Adds a grid of lamps with random intensities from `min_intensity` to `max_intensity`.
void add_lamps(SceneBuilder& builder, const FloorArea& room, double height_m, double spacing_m,
               double min_intensity = 0.1, double max_intensity = 1.0) {
  const double width = room.high.x_m - room.low.x_m;
  const double depth = room.high.y_m - room.low.y_m;
  const int columns = std::max(1, static_cast<int>(width / spacing_m));
  const int rows = std::max(1, static_cast<int>(depth / spacing_m));
  const int lamp_material = builder.add_plain_material({0.98F, 0.98F, 0.95F}, 1.0F);
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      const Point2 at{room.low.x_m + (i + 0.5) * width / columns,
                      room.low.y_m + (j + 0.5) * depth / rows};
      builder.add_lamp({at.x_m, at.y_m, height_m - 0.2},
                       static_cast<float>(builder.random().uniform(min_intensity, max_intensity)));
      builder.add_box("lamp", lamp_material, lamp_material, {at, 0.0}, {0.0, 0.0, height_m - 0.1},
                      {1.2, 0.25, 0.06});
    }
  }
}

// Materials of the walls of the periodic hall.
struct PeriodicWallStyle {
  int plaster, poster, door, stone;
  double height_m;
};

// Adds a wall with the same picture and pillar every 2 m; wall 0 has a door instead of one picture.
void add_periodic_wall(SceneBuilder& builder, const PeriodicWallStyle& style, std::size_t number,
                       Point2 from, Point2 to) {
  const std::string wall = "wall " + std::to_string(number);
  const double length = distance(from, to);
  const auto on_line = [&](double along) {
    const double share = along / length;
    return Point2{from.x_m + share * (to.x_m - from.x_m), from.y_m + share * (to.y_m - from.y_m)};
  };
  constexpr double pillar_width_m = 0.35;
  double wall_from = 0.0;  // start of the next piece of wall, after a pillar
  for (double along = 0.5; along + 1.0 < length; along += 2.0) {
    const bool is_door = number == 0 && std::abs(along - 4.5) < 1e-9;
    if (is_door) {
      builder.add_on_wall("door", style.door, from, to, along, 0.9, 0.0, 2.1);
    } else {
      builder.add_on_wall(wall + " picture", style.poster, from, to, along, 0.9, 0.6, 1.8);
    }
    const double pillar = along + 1.45;
    builder.add_box(wall + " pillar", style.stone, style.stone, {on_line(pillar), 0.0},
                    {0.0, 0.0, 0.0}, {pillar_width_m, pillar_width_m, style.height_m}, 1.0);
    builder.add_wall(wall, style.plaster, on_line(wall_from),
                     on_line(pillar - 0.5 * pillar_width_m), style.height_m, 2.0);
    wall_from = pillar + 0.5 * pillar_width_m;
  }
  builder.add_wall(wall, style.plaster, on_line(wall_from), to, style.height_m, 2.0);
}

}  // namespace

Scene make_office(const SceneVariation& variation) {
  SceneBuilder builder("office", variation);
  Scene& scene = builder.scene();
  scene.floor_low = {0.0, 0.0};
  scene.floor_high = {5.0, 2.0};
  scene.drivable = {{{-0.25, -0.25}, {5.25, 2.25}}};
  scene.ambient = 0.4F;
  const FloorArea room{{-1.6, -1.5}, {6.6, 3.5}};
  constexpr double room_height_m = 2.6;
  furnish_room_shell(builder, room, room_height_m);
  // The furniture is so near to the walls that chairs in front of desks leave the 5 x 2 m free.
  furnish_walls(builder, room, 0.5, {desk_kind, shelf_kind});
  add_lamps(builder, room, room_height_m, 2.5);
  scene.tour = {{0.3, 0.3}, {4.7, 0.3}, {4.7, 1.7}, {0.3, 1.7}};
  return builder.finish();
}

Scene make_lab(const SceneVariation& variation) {
  SceneBuilder builder("lab", variation);
  Scene& scene = builder.scene();
  scene.floor_low = {0.0, 0.0};
  scene.floor_high = {7.0, 5.0};
  scene.drivable = {{{0.9, 1.2}, {6.1, 3.8}}};
  scene.ambient = 0.4F;
  const FloorArea room{{0.0, 0.0}, {7.0, 5.0}};
  constexpr double room_height_m = 2.8;
  furnish_room_shell(builder, room, room_height_m);
  furnish_walls(builder, room, 0.5);
  add_lamps(builder, room, room_height_m, 2.5);
  scene.tour = {{1.6, 1.6}, {5.4, 1.6}, {5.4, 3.4}, {1.6, 3.4}};
  return builder.finish();
}

Scene make_hall(const SceneVariation& variation, bool periodic) {
  SceneBuilder builder(periodic ? "hall_periodic" : "hall", variation);
  Scene& scene = builder.scene();
  Random& random = builder.random();
  scene.floor_low = {0.0, 0.0};
  scene.floor_high = {7.0, 7.0};
  scene.drivable = {{{-0.3, -0.3}, {7.3, 7.3}}};
  scene.ambient = 0.4F;
  const FloorArea room{{-2.0, -2.0}, {9.0, 9.0}};
  constexpr double room_height_m = 3.5;
  if (!periodic) {
    furnish_room_shell(builder, room, room_height_m);
    furnish_walls(builder, room, 0.9);
    add_lamps(builder, room, room_height_m, 3.0);
    scene.tour = {{0.5, 0.5}, {6.5, 0.5}, {6.5, 6.5}, {0.5, 6.5}};
    return builder.finish();
  }
  // All walls have the same picture and pillar every 2 m; only one clock and one door distinguish
  // them.
  const Colour joint = sample_colour(random, 0.1, 0.4, 0.1);
  const Colour tile = sample_colour(random, 0.3, 0.6, 0.1);
  builder.add_floor(builder.add_textured_material(brick_texture(random, 128, 2, 2, tile, joint)),
                    room.low, room.high, 1.0);
  builder.add_ceiling(builder.add_plain_material({0.85F, 0.85F, 0.83F}), room.low, room.high,
                      room_height_m, 1.0);
  const int plaster = builder.add_textured_material(
      noise_texture(random, 128, sample_colour(random, 0.45, 0.8, 0.1), 0.05));
  const int poster = builder.add_textured_material(poster_texture(random, 128));
  const int door = builder.add_textured_material(
      door_texture(random, 128, sample_colour(random, 0.2, 0.6, 0.3)));
  const int stone = builder.add_textured_material(
      noise_texture(random, 128, sample_colour(random, 0.15, 0.7, 0.1), 0.1));
  const std::array<Point2, 4> corners{room.low, Point2{room.high.x_m, room.low.y_m}, room.high,
                                      Point2{room.low.x_m, room.high.y_m}};
  for (std::size_t i = 0; i < 4; ++i) {
    add_periodic_wall(builder, {plaster, poster, door, stone, room_height_m}, i, corners[i],
                      corners[(i + 1) % 4]);
  }
  builder.add_on_wall("clock", builder.add_textured_material(poster_texture(random, 64)),
                      corners[2], corners[3], 4.65, 0.6, 2.0, 2.6);
  add_lamps(builder, room, room_height_m, 3.0, 0.6, 0.6);
  scene.tour = {{0.5, 0.5}, {6.5, 0.5}, {6.5, 6.5}, {0.5, 6.5}};
  return builder.finish();
}

namespace {

// Materials that the things in an industrial hall share.
struct HallMaterials {
  std::array<int, 6> goods{};
  std::array<int, 8> paints{};
  int steel = 0;
};

// Adds rows of pallet racks, whose goods differ from bay to bay.
void add_racks(SceneBuilder& builder, const std::string& name, const HallMaterials& materials,
               const FloorArea& block) {
  Random& random = builder.random();
  constexpr double bay_m = 2.8;
  const double height_m = random.uniform(3.5, 6.0);
  int row = 0;
  for (double y = block.low.y_m + 0.8; y < block.high.y_m; y += 3.6, ++row) {
    for (double x = block.low.x_m + 0.5 * bay_m; x + 0.5 * bay_m <= block.high.x_m; x += bay_m) {
      const int goods = materials.goods[random.index(materials.goods.size())];
      builder.add_box(name + " rack " + std::to_string(row), goods, materials.steel, {{x, y}, 0.0},
                      {0.0, 0.0, 0.0}, {bay_m - 0.1, 1.1, random.uniform() < 0.15 ? 1.3 : height_m},
                      1.4);
    }
  }
}

// Adds machines: large bodies with a tank or a cabinet on some of them.
void add_machines(SceneBuilder& builder, const std::string& name, const HallMaterials& materials,
                  const FloorArea& block) {
  Random& random = builder.random();
  int number = 0;
  for (double x = block.low.x_m + 2.5; x < block.high.x_m - 2.0; x += 5.0) {
    for (double y = block.low.y_m + 2.2; y < block.high.y_m - 2.0; y += 5.0) {
      const std::string machine = name + " machine " + std::to_string(number++);
      const Footing footing{{x, y}, random.normal(0.0, 0.1)};
      const int paint = materials.paints[random.index(materials.paints.size())];
      const Vector3 size{random.uniform(1.5, 3.8), random.uniform(1.2, 3.2),
                         random.uniform(0.9, 2.6)};
      builder.add_box(machine, paint, materials.steel, footing, {0.0, 0.0, 0.0}, size);
      const int other = materials.paints[random.index(materials.paints.size())];
      if (random.uniform() < 0.5) {
        builder.add_cylinder(machine, other, footing.centre, size.z_m, size.z_m + 1.8, 0.5, 12);
      } else {
        builder.add_box(machine, other, other, footing, {0.3 * size.x_m, 0.0, size.z_m},
                        {0.8, 0.9, random.uniform(0.4, 1.5)});
      }
    }
  }
}

// Adds crates and cabinets that are moved from day to day.
void add_stores(SceneBuilder& builder, const std::string& name, const FloorArea& block) {
  Random& random = builder.random();
  int number = 0;
  for (double x = block.low.x_m + 1.0; x < block.high.x_m - 0.5; x += 2.6) {
    for (double y = block.low.y_m + 1.0; y < block.high.y_m - 0.5; y += 3.0) {
      if (random.uniform() < 0.3) continue;
      const Footing planned{{x + random.uniform(-0.4, 0.4), y + random.uniform(-0.4, 0.4)},
                            random.uniform(-3.0, 3.0)};
      const Footing footing = builder.place_movable(planned, 0.9, block);
      add_crate(builder, name + " crate " + std::to_string(number++), footing,
                {random.uniform(0.6, 1.6), random.uniform(0.5, 1.1), random.uniform(0.5, 2.2)});
    }
  }
}

}  // namespace

Scene make_industrial_hall(const SceneVariation& variation) {
  SceneBuilder builder("industrial_hall", variation);
  Scene& scene = builder.scene();
  Random& random = builder.random();
  scene.floor_low = {0.0, 0.0};
  scene.floor_high = {104.0, 62.0};
  scene.robot_radius_m = 0.4;
  scene.camera_height_m = 1.0;
  scene.ambient = 0.35F;
  // Aisles 4 m wide run around 4 x 3 blocks of 20 x 14 m.
  constexpr double aisle_m = 4.0;
  constexpr double block_x_m = 20.0;
  constexpr double block_y_m = 14.0;
  constexpr double pitch_x_m = block_x_m + aisle_m;
  constexpr double pitch_y_m = block_y_m + aisle_m;
  const FloorArea aisles{{2.0, 2.0}, {102.0, 60.0}};
  for (int i = 0; i <= 4; ++i) {
    const double x_m = aisles.low.x_m + i * pitch_x_m;
    scene.drivable.push_back({{x_m, aisles.low.y_m}, {x_m + aisle_m, aisles.high.y_m}});
  }
  for (int j = 0; j <= 3; ++j) {
    const double y_m = aisles.low.y_m + j * pitch_y_m;
    scene.drivable.push_back({{aisles.low.x_m, y_m}, {aisles.high.x_m, y_m + aisle_m}});
  }
  scene.tour = {{4.0, 4.0}, {52.0, 4.0}, {52.0, 22.0}, {4.0, 22.0}};
  constexpr double hall_height_m = 8.0;
  const FloorArea hall{scene.floor_low, scene.floor_high};
  furnish_room_shell(builder, hall, hall_height_m);
  add_lamps(builder, hall, hall_height_m, 13.0, 14.0, 36.0);
  HallMaterials materials;
  for (int& goods : materials.goods) {
    goods = builder.add_textured_material(bookshelf_texture(random, 256, 2));
  }
  for (int& paint : materials.paints) {
    paint = builder.add_textured_material(
        noise_texture(random, 64, sample_colour(random, 0.08, 0.85, 0.35), 0.12, 2.2));
  }
  materials.steel = builder.add_plain_material({0.3F, 0.32F, 0.35F});
  // Four blocks each of racks, machines and stores, in random order.
  std::array<std::size_t, 12> kinds{0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2};
  for (std::size_t i = kinds.size() - 1; i > 0; --i) {
    std::swap(kinds[i], kinds[random.index(i + 1)]);
  }
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Point2 low{aisles.low.x_m + aisle_m + i * pitch_x_m,
                       aisles.low.y_m + aisle_m + j * pitch_y_m};
      const FloorArea block{low, {low.x_m + block_x_m, low.y_m + block_y_m}};
      const std::string name = "block " + std::to_string(3 * i + j);
      const std::size_t kind = kinds[static_cast<std::size_t>(3 * i + j)];
      if (kind == 0) add_racks(builder, name, materials, block);
      if (kind == 1) add_machines(builder, name, materials, block);
      if (kind == 2) add_stores(builder, name, block);
      builder.add_cylinder(name + " column", materials.steel, low, 0.0, hall_height_m, 0.25, 8);
    }
  }
  return builder.finish();
}

}  // namespace panonav::simulation
