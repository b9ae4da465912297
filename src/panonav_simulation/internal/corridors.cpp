// Scenes with a round trip: loop (rooms and corridors) and corridor (many identical doors).

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "panonav_simulation/furniture.hpp"
#include "panonav_simulation/internal/built_in_scenes.hpp"

namespace panonav::simulation {

namespace {

std::array<Point2, 4> compute_corners(const FloorArea& area) {
  return {area.low, Point2{area.high.x_m, area.low.y_m}, area.high,
          Point2{area.low.x_m, area.high.y_m}};
}

void add_ceiling_lamp(SceneBuilder& builder, int lamp_material, Point2 at, double height_m,
                      float intensity) {
  builder.add_lamp({at.x_m, at.y_m, height_m - 0.15}, intensity);
  builder.add_box("lamp", lamp_material, lamp_material, {at, 0.0}, {0.0, 0.0, height_m - 0.07},
                  {0.6, 0.2, 0.05});
}

struct CorridorStyle {
  int plaster, rail, door;
  double height_m;
};

// Adds a closed polygon of walls parallel to the axes, visible from their left, with a rail along
// all of them. There is a door at every even coordinate where it fits.
void add_wall_with_doors(SceneBuilder& builder, const std::string& name, const CorridorStyle& style,
                         std::span<const Point2> corners) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Point2 from = corners[i];
    const Point2 to = corners[(i + 1) % corners.size()];
    const double length = distance(from, to);
    builder.add_wall(name, style.plaster, from, to, style.height_m, 2.0);
    builder.add_on_wall(name + " rail", style.rail, from, to, 0.0, length, 0.85, 0.95, 0.005);
    const bool along_x = from.y_m == to.y_m;
    const double a = along_x ? from.x_m : from.y_m;
    const double b = along_x ? to.x_m : to.y_m;
    constexpr double half_door_m = 0.45;
    for (double at = 2.0 * std::ceil(0.5 * (std::min(a, b) + half_door_m));
         at <= std::max(a, b) - half_door_m; at += 2.0) {
      builder.add_on_wall(name + " door", style.door, from, to, std::abs(at - a) - half_door_m,
                          2.0 * half_door_m, 0.0, 2.05);
    }
  }
}

// Adds the piece of wall above an opening.
void add_lintel(SceneBuilder& builder, const CorridorStyle& style, Point2 from, Point2 to) {
  builder.add_wall("lintel", style.plaster, from, to, style.height_m, 2.0, 2.3);
}

// Outer walls and block of `loop`: the round trip leads around the block, through two rooms, below
// and above, and two corridors between them.
constexpr FloorArea loop_outside{{-1.5, -1.5}, {7.5, 5.5}};
constexpr FloorArea loop_block{{1.0, 1.0}, {5.0, 3.0}};
constexpr double loop_height_m = 2.5;

// Adds the block's walls, each with its own pictures.
void add_block(SceneBuilder& builder) {
  Random& random = builder.random();
  const auto inner = compute_corners(loop_block);
  for (std::size_t i = 0; i < 4; ++i) {
    // Clockwise, so that pictures are on the outer side of the block.
    const Point2 from = inner[(i + 1) % 4];
    const Point2 to = inner[i];
    const auto tone = static_cast<float>(random.uniform(0.4, 0.85));
    const std::string wall = "block " + std::to_string(i);
    builder.add_wall(wall,
                     builder.add_textured_material(
                         noise_texture(random, 128, {tone, 0.95F * tone, 0.85F * tone}, 0.07)),
                     from, to, loop_height_m, 2.0);
    double along = random.uniform(0.2, 0.6);
    while (along < distance(from, to) - 0.5) {
      const double width = random.uniform(0.4, 0.9);
      const double bottom = random.uniform(0.5, 1.2);
      const double top = bottom + width * random.uniform(0.7, 1.2);
      const int picture = builder.add_textured_material(poster_texture(random, 128));
      builder.add_on_wall(wall + " picture", picture, from, to, along, width, bottom, top);
      along += width + random.uniform(0.3, 0.9);
    }
  }
}

// Adds walls with doorways of 1.2 m between rooms and corridors.
void add_doorways(SceneBuilder& builder) {
  Random& random = builder.random();
  const int plaster =
      builder.add_textured_material(noise_texture(random, 128, {0.7F, 0.69F, 0.64F}, 0.06));
  const int frame = builder.add_textured_material(wood_texture(random, 64, {0.4F, 0.28F, 0.2F}));
  int number = 0;
  for (const double y : {1.0, 3.0}) {
    for (const bool left : {true, false}) {
      const double x0 = left ? loop_outside.low.x_m : loop_block.high.x_m;
      const double x1 = left ? loop_block.low.x_m : loop_outside.high.x_m;
      const double door = left ? 0.0 : 6.0;
      const std::string name = "doorway " + std::to_string(number++);
      const auto add_wall_piece = [&](double a, double b) {
        if (b - a > 0.05) {
          builder.add_box(name, plaster, plaster, {{0.5 * (a + b), y}, 0.0}, {0.0, 0.0, 0.0},
                          {b - a, 0.1, loop_height_m}, 1.5);
        }
      };
      add_wall_piece(x0, door - 0.65);
      add_wall_piece(door + 0.65, x1);
      builder.add_box(name + " lintel", plaster, frame, {{door, y}, 0.0}, {0.0, 0.0, 2.1},
                      {1.3, 0.1, loop_height_m - 2.1}, 1.5);
      for (const double side : {-0.65, 0.65}) {
        builder.add_box(name + " frame", frame, frame, {{door + side, y}, 0.0}, {0.0, 0.0, 0.0},
                        {0.08, 0.16, 2.1}, 0.5);
      }
    }
  }
}

// Adds a piece of furniture of a random kind.
void add_random_furniture(SceneBuilder& builder, const std::string& name, const Footing& footing) {
  Random& random = builder.random();
  switch (random.index(4)) {
    case 0: {
      const double height_m = random.uniform(1.0, 2.0);
      const double width_m = random.uniform(0.7, 1.0);
      return add_shelf(builder, name, footing, width_m, height_m);
    }
    case 1:
      return add_cabinet(builder, name, footing);
    case 2:
      return add_plant(builder, name, footing.centre);
    default:
      add_crate(builder, name, footing, {random.uniform(0.3, 0.6), 0.4, random.uniform(0.4, 1.2)});
  }
}

// Adds furniture along the outer walls.
void furnish_loop(SceneBuilder& builder) {
  Random& random = builder.random();
  const FloorArea inside{{loop_outside.low.x_m + 0.1, loop_outside.low.y_m + 0.1},
                         {loop_outside.high.x_m - 0.1, loop_outside.high.y_m - 0.1}};
  int number = 4;  // indices 0 .. 3 are doorways
  const auto furnish = [&](Point2 at, double turn_rad) {
    const Footing footing = builder.place_movable({at, turn_rad}, 0.4, inside);
    add_random_furniture(builder, "furniture " + std::to_string(number++), footing);
  };
  for (double x = -1.0; x < 7.2; x += random.uniform(0.9, 1.7)) {
    furnish({x, -1.15}, std::numbers::pi);
    furnish({x + random.uniform(-0.3, 0.3), 5.15}, 0.0);
  }
  for (double y = 1.5; y < 2.8; y += random.uniform(0.8, 1.2)) {
    furnish({-1.2, y}, 0.5 * std::numbers::pi);
    furnish({7.2, y}, -0.5 * std::numbers::pi);
  }
}

}  // namespace

Scene make_loop(const SceneVariation& variation) {
  SceneBuilder builder("loop", variation);
  Scene& scene = builder.scene();
  scene.floor_low = {-0.5, -0.5};
  scene.floor_high = {6.5, 4.5};
  scene.drivable = {{{-0.5, -0.5}, {6.5, 0.5}},
                    {{-0.5, 3.5}, {6.5, 4.5}},
                    {{-0.5, -0.5}, {0.5, 4.5}},
                    {{5.5, -0.5}, {6.5, 4.5}}};
  scene.ambient = 0.4F;
  scene.tour = {{0.0, 0.0}, {6.0, 0.0}, {6.0, 4.0}, {0.0, 4.0}};
  furnish_room_shell(builder, loop_outside, loop_height_m);
  add_block(builder);
  add_doorways(builder);
  furnish_loop(builder);
  const int lamp_material = builder.add_plain_material({0.98F, 0.98F, 0.95F}, 1.0F);
  for (const Point2 at : {Point2{0.0, 0.0}, Point2{3.0, 0.0}, Point2{6.0, 0.0}, Point2{6.0, 2.0},
                          Point2{6.0, 4.0}, Point2{3.0, 4.0}, Point2{0.0, 4.0}, Point2{0.0, 2.0}}) {
    add_ceiling_lamp(builder, lamp_material, at, loop_height_m,
                     static_cast<float>(builder.random().uniform(0.6, 1.0)));
  }
  return builder.finish();
}

namespace {

// A ring of corridors, 2 m wide, with centre lines 12 m and 8 m long. Two narrower corridors cross
// the block inside and continue outside to a dead end, which makes eight similar junctions.
constexpr double ring_height_m = 2.5;
constexpr double ring_half_width_m = 1.0;
constexpr double ring_long_m = 12.0;
constexpr double ring_short_m = 8.0;
constexpr std::array<double, 2> crossings_m{4.0, 8.0};
constexpr double crossing_half_width_m = 0.65;
constexpr double dead_end_m = 2.0;

// Adds the outer wall with the dead ends, counter-clockwise, so that its inside is visible.
void add_outer_wall(SceneBuilder& builder, const CorridorStyle& style) {
  std::vector<Point2> outline;
  for (const double side : {1.0, -1.0}) {
    const double y = side > 0.0 ? -ring_half_width_m : ring_short_m + ring_half_width_m;
    const double end = y - side * dead_end_m;
    outline.push_back({side > 0.0 ? -ring_half_width_m : ring_long_m + ring_half_width_m, y});
    for (std::size_t i = 0; i < crossings_m.size(); ++i) {
      const double x = crossings_m[side > 0.0 ? i : crossings_m.size() - 1 - i];
      const double half = side * crossing_half_width_m;
      outline.insert(outline.end(),
                     {{x - half, y}, {x - half, end}, {x + half, end}, {x + half, y}});
      add_lintel(builder, style, {x - half, y}, {x + half, y});
    }
    outline.push_back({side > 0.0 ? ring_long_m + ring_half_width_m : -ring_half_width_m, y});
  }
  add_wall_with_doors(builder, "outer wall", style, outline);
}

// Adds the blocks between the corridors, clockwise, so that their outside is visible.
void add_inner_blocks(SceneBuilder& builder, const CorridorStyle& style) {
  const std::array<double, 6> edges{ring_half_width_m,
                                    crossings_m[0] - crossing_half_width_m,
                                    crossings_m[0] + crossing_half_width_m,
                                    crossings_m[1] - crossing_half_width_m,
                                    crossings_m[1] + crossing_half_width_m,
                                    ring_long_m - ring_half_width_m};
  for (std::size_t i = 0; i < edges.size(); i += 2) {
    auto corners = compute_corners(
        {{edges[i], ring_half_width_m}, {edges[i + 1], ring_short_m - ring_half_width_m}});
    std::reverse(corners.begin(), corners.end());
    add_wall_with_doors(builder, "inner wall " + std::to_string(i / 2), style, corners);
    if (i == 0) continue;
    for (const double y : {ring_half_width_m, ring_short_m - ring_half_width_m}) {
      add_lintel(builder, style, {edges[i - 1], y}, {edges[i], y});
    }
  }
}

// Adds the few distinct objects: a window, a notice board and a plant, each on a different side.
void add_distinct_places(SceneBuilder& builder) {
  Random& random = builder.random();
  builder.add_on_wall("window", builder.add_textured_material(window_texture(random, 128), 0.8F),
                      {-ring_half_width_m, -ring_half_width_m},
                      {ring_long_m + ring_half_width_m, -ring_half_width_m}, 11.55, 0.9, 0.9, 2.1);
  const double along = random.uniform() < 0.5 ? 1.5 : 11.5;
  const int board = builder.add_textured_material(poster_texture(random, 128));
  builder.add_on_wall("notice board", board,
                      {ring_long_m + ring_half_width_m, ring_short_m + ring_half_width_m},
                      {-ring_half_width_m, ring_short_m + ring_half_width_m}, along, 1.0, 0.8, 1.6);
  add_plant(builder, "plant", {-ring_half_width_m + 0.3, random.uniform(2.0, 6.0)});
}

void add_ring_lamps(SceneBuilder& builder) {
  const int lamp_material = builder.add_plain_material({0.98F, 0.98F, 0.95F}, 1.0F);
  for (double x = 0.0; x <= ring_long_m + 0.1; x += 2.0) {
    add_ceiling_lamp(builder, lamp_material, {x, 0.0}, ring_height_m, 0.7F);
    add_ceiling_lamp(builder, lamp_material, {x, ring_short_m}, ring_height_m, 0.7F);
  }
  for (double y = 2.0; y < ring_short_m - 0.1; y += 2.0) {
    add_ceiling_lamp(builder, lamp_material, {0.0, y}, ring_height_m, 0.7F);
    add_ceiling_lamp(builder, lamp_material, {ring_long_m, y}, ring_height_m, 0.7F);
    for (const double x : crossings_m)
      add_ceiling_lamp(builder, lamp_material, {x, y}, ring_height_m, 0.7F);
  }
}

}  // namespace

Scene make_corridor(const SceneVariation& variation) {
  SceneBuilder builder("corridor", variation);
  Scene& scene = builder.scene();
  Random& random = builder.random();
  scene.floor_low = {-0.6, -0.6};
  scene.floor_high = {ring_long_m + 0.6, ring_short_m + 0.6};
  scene.drivable = {{{-0.6, -0.6}, {ring_long_m + 0.6, 0.6}},
                    {{-0.6, ring_short_m - 0.6}, {ring_long_m + 0.6, ring_short_m + 0.6}},
                    {{-0.6, -0.6}, {0.6, ring_short_m + 0.6}},
                    {{ring_long_m - 0.6, -0.6}, {ring_long_m + 0.6, ring_short_m + 0.6}}};
  for (const double x : crossings_m) {
    scene.drivable.push_back({{x - 0.4, -0.6}, {x + 0.4, ring_short_m + 0.6}});
  }
  scene.ambient = 0.65F;
  scene.tour = {{0.0, 0.0}, {ring_long_m, 0.0}, {ring_long_m, ring_short_m}, {0.0, ring_short_m}};

  const Point2 low{-ring_half_width_m, -ring_half_width_m - dead_end_m};
  const Point2 high{ring_long_m + ring_half_width_m, ring_short_m + ring_half_width_m + dead_end_m};
  const int carpet = builder.add_textured_material(
      noise_texture(random, 128, sample_colour(random, 0.15, 0.5, 0.2), 0.08));
  builder.add_floor(carpet, low, high, 1.0);
  builder.add_ceiling(builder.add_plain_material({0.85F, 0.85F, 0.84F}), low, high, ring_height_m,
                      1.0);
  const CorridorStyle style{builder.add_textured_material(noise_texture(
                                random, 128, sample_colour(random, 0.5, 0.75, 0.1), 0.04)),
                            builder.add_plain_material(sample_colour(random, 0.1, 0.4, 0.2)),
                            builder.add_textured_material(
                                door_texture(random, 128, sample_colour(random, 0.1, 0.45, 0.3))),
                            ring_height_m};
  add_outer_wall(builder, style);
  add_inner_blocks(builder, style);
  add_distinct_places(builder);
  add_ring_lamps(builder);
  return builder.finish();
}

}  // namespace panonav::simulation
