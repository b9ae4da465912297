// Scenes with a round trip: loop (rooms and corridors) and corridor (many identical doors).

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "panonav/simulation/built_in_scenes.hpp"
#include "panonav/simulation/furniture.hpp"

namespace panonav {

namespace {

std::array<Point2, 4> corners_of(const FloorArea& area) {
  return {area.low, Point2{area.high.x_m, area.low.y_m}, area.high,
          Point2{area.low.x_m, area.high.y_m}};
}

void add_ceiling_lamp(SceneBuilder& builder, int shine, Point2 at, double height_m,
                      float intensity) {
  builder.lamp({at.x_m, at.y_m, height_m - 0.15}, intensity);
  builder.box("lamp", shine, shine, {at, 0.0}, {0.0, 0.0, height_m - 0.07}, {0.6, 0.2, 0.05});
}

}  // namespace

Scene make_loop(const SceneVariation& variation) {
  SceneBuilder builder("loop", variation);
  Scene& scene = builder.scene();
  Random& random = builder.random();
  // The round trip runs around a block: two rooms, below and above, joined by two corridors.
  const FloorArea outside{{-1.5, -1.5}, {7.5, 5.5}};
  const FloorArea block{{1.0, 1.0}, {5.0, 3.0}};
  constexpr double kHeight = 2.5;
  scene.floor_low = {-0.5, -0.5};
  scene.floor_high = {6.5, 4.5};
  scene.drivable = {{{-0.5, -0.5}, {6.5, 0.5}},
                    {{-0.5, 3.5}, {6.5, 4.5}},
                    {{-0.5, -0.5}, {0.5, 4.5}},
                    {{5.5, -0.5}, {6.5, 4.5}}};
  scene.ambient = 0.65F;
  scene.tour = {{0.0, 0.0}, {6.0, 0.0}, {6.0, 4.0}, {0.0, 4.0}};
  furnish_room_shell(builder, outside, kHeight);
  const auto inner = corners_of(block);
  for (std::size_t i = 0; i < 4; ++i) {
    // Backwards, so that pictures hang on the outer side.
    const Point2 from = inner[(i + 1) % 4];
    const Point2 to = inner[i];
    const auto tone = static_cast<float>(random.uniform(0.4, 0.85));
    const std::string wall = "block " + std::to_string(i);
    builder.wall(
        wall,
        builder.textured(noise_texture(random, 128, {tone, 0.95F * tone, 0.85F * tone}, 0.07)),
        from, to, kHeight, 2.0);
    double along = random.uniform(0.2, 0.6);
    while (along < distance(from, to) - 0.5) {
      const double width = random.uniform(0.4, 0.9);
      const double bottom = random.uniform(0.5, 1.2);
      builder.on_wall(wall + " picture", builder.textured(poster_texture(random, 128)), from, to,
                      along, width, bottom, bottom + width * random.uniform(0.7, 1.2));
      along += width + random.uniform(0.3, 0.9);
    }
  }
  // Walls with a doorway of 1.2 m part rooms from corridors.
  const int plaster = builder.textured(noise_texture(random, 128, {0.7F, 0.69F, 0.64F}, 0.06));
  const int frame = builder.textured(wood_texture(random, 64, {0.4F, 0.28F, 0.2F}));
  int number = 0;
  for (const double y : {1.0, 3.0}) {
    for (const bool left : {true, false}) {
      const double x0 = left ? outside.low.x_m : block.high.x_m;
      const double x1 = left ? block.low.x_m : outside.high.x_m;
      const double door = left ? 0.0 : 6.0;
      const std::string name = "doorway " + std::to_string(number++);
      const auto piece = [&](double a, double b) {
        if (b - a > 0.05) {
          builder.box(name, plaster, plaster, {{0.5 * (a + b), y}, 0.0}, {0.0, 0.0, 0.0},
                      {b - a, 0.1, kHeight}, 1.5);
        }
      };
      piece(x0, door - 0.65);
      piece(door + 0.65, x1);
      builder.box(name + " lintel", plaster, frame, {{door, y}, 0.0}, {0.0, 0.0, 2.1},
                  {1.3, 0.1, kHeight - 2.1}, 1.5);
      for (const double side : {-0.65, 0.65}) {
        builder.box(name + " frame", frame, frame, {{door + side, y}, 0.0}, {0.0, 0.0, 0.0},
                    {0.08, 0.16, 2.1}, 0.5);
      }
    }
  }
  // Furniture along the outer walls.
  const FloorArea inside{{outside.low.x_m + 0.1, outside.low.y_m + 0.1},
                         {outside.high.x_m - 0.1, outside.high.y_m - 0.1}};
  const auto furnish = [&](Point2 at, double turn_rad) {
    const Footing footing = builder.movable({at, turn_rad}, 0.4, inside);
    const std::string name = "furniture " + std::to_string(number++);
    switch (random.index(4)) {
      case 0:
        add_shelf(builder, name, footing, random.uniform(0.7, 1.0), random.uniform(1.0, 2.0));
        break;
      case 1:
        add_cabinet(builder, name, footing);
        break;
      case 2:
        add_plant(builder, name, footing.centre);
        break;
      default:
        add_crate(builder, name, footing,
                  {random.uniform(0.3, 0.6), 0.4, random.uniform(0.4, 1.2)});
    }
  };
  for (double x = -1.0; x < 7.2; x += random.uniform(0.9, 1.7)) {
    furnish({x, -1.15}, std::numbers::pi);
    furnish({x + random.uniform(-0.3, 0.3), 5.15}, 0.0);
  }
  for (double y = 1.5; y < 2.8; y += random.uniform(0.8, 1.2)) {
    furnish({-1.2, y}, 0.5 * std::numbers::pi);
    furnish({7.2, y}, -0.5 * std::numbers::pi);
  }
  const int shine = builder.plain({0.98F, 0.98F, 0.95F}, 1.0F);
  for (const Point2 at : {Point2{0.0, 0.0}, Point2{3.0, 0.0}, Point2{6.0, 0.0}, Point2{6.0, 2.0},
                          Point2{6.0, 4.0}, Point2{3.0, 4.0}, Point2{0.0, 4.0}, Point2{0.0, 2.0}}) {
    add_ceiling_lamp(builder, shine, at, kHeight, static_cast<float>(random.uniform(0.6, 1.0)));
  }
  return builder.finish();
}

Scene make_corridor(const SceneVariation& variation) {
  SceneBuilder builder("corridor", variation);
  Scene& scene = builder.scene();
  Random& random = builder.random();
  // A ring of corridors, 2 m wide, round a block; the middle lines are 12 m and 8 m long.
  constexpr double kHeight = 2.5;
  constexpr double kHalf = 1.0;
  constexpr double kLong = 12.0;
  constexpr double kShort = 8.0;
  const FloorArea outside{{-kHalf, -kHalf}, {kLong + kHalf, kShort + kHalf}};
  const FloorArea block{{kHalf, kHalf}, {kLong - kHalf, kShort - kHalf}};
  scene.floor_low = {-0.6, -0.6};
  scene.floor_high = {kLong + 0.6, kShort + 0.6};
  scene.drivable = {{{-0.6, -0.6}, {kLong + 0.6, 0.6}},
                    {{-0.6, kShort - 0.6}, {kLong + 0.6, kShort + 0.6}},
                    {{-0.6, -0.6}, {0.6, kShort + 0.6}},
                    {{kLong - 0.6, -0.6}, {kLong + 0.6, kShort + 0.6}}};
  scene.ambient = 0.65F;
  scene.tour = {{0.0, 0.0}, {kLong, 0.0}, {kLong, kShort}, {0.0, kShort}};

  const int carpet = builder.textured(noise_texture(random, 128, {0.3F, 0.3F, 0.34F}, 0.08));
  builder.floor(carpet, outside.low, outside.high, 1.0);
  builder.ceiling(builder.plain({0.85F, 0.85F, 0.84F}), outside.low, outside.high, kHeight, 1.0);
  const int plaster = builder.textured(noise_texture(random, 128, {0.72F, 0.7F, 0.64F}, 0.04));
  const int rail = builder.plain({0.3F, 0.25F, 0.2F});
  const int door = builder.textured(door_texture(random, 128, {0.42F, 0.3F, 0.2F}));
  const int opening = builder.plain({0.05F, 0.05F, 0.06F});
  // Every wall repeats itself every 2 m: a door; at two places of each long wall a dark side
  // passage instead.
  const auto dress = [&](const std::string& name, Point2 from, Point2 to, bool passages) {
    builder.wall(name, plaster, from, to, kHeight, 2.0);
    builder.on_wall(name + " rail", rail, from, to, 0.0, distance(from, to), 0.85, 0.95, 0.005);
    const double length = distance(from, to);
    const int doors = static_cast<int>(length / 2.0);
    const double first = 0.5 * (length - 2.0 * doors) + 0.55;
    for (int i = 0; i < doors; ++i) {
      const bool passage = passages && (i == doors / 3 || i == 2 * doors / 3);
      builder.on_wall(name + (passage ? " passage" : " door"), passage ? opening : door, from, to,
                      first + 2.0 * i - (passage ? 0.2 : 0.0), passage ? 1.3 : 0.9, 0.0,
                      passage ? 2.3 : 2.05);
    }
  };
  const auto outer = corners_of(outside);
  const auto inner = corners_of(block);
  for (std::size_t i = 0; i < 4; ++i) {
    dress("outer wall " + std::to_string(i), outer[i], outer[(i + 1) % 4], i % 2 == 0);
    dress("inner wall " + std::to_string(i), inner[(i + 1) % 4], inner[i], i % 2 == 0);
  }
  // The few distinct places: a window at one corner, a notice board and a plant on two of the
  // sides.
  builder.on_wall("window", builder.textured(window_texture(random, 128), 0.8F), outer[0], outer[1],
                  kLong + 0.2, 1.4, 0.9, 2.1);
  builder.on_wall("notice board", builder.textured(poster_texture(random, 128)), outer[2], outer[3],
                  random.uniform(3.0, 9.0), 1.0, 0.8, 1.6);
  add_plant(builder, "plant", {outside.low.x_m + 0.3, random.uniform(2.0, 6.0)});
  const int shine = builder.plain({0.98F, 0.98F, 0.95F}, 1.0F);
  for (double x = 0.0; x <= kLong + 0.1; x += 2.0) {
    add_ceiling_lamp(builder, shine, {x, 0.0}, kHeight, 0.7F);
    add_ceiling_lamp(builder, shine, {x, kShort}, kHeight, 0.7F);
  }
  for (double y = 2.0; y < kShort - 0.1; y += 2.0) {
    add_ceiling_lamp(builder, shine, {0.0, y}, kHeight, 0.7F);
    add_ceiling_lamp(builder, shine, {kLong, y}, kHeight, 0.7F);
  }
  return builder.finish();
}

}  // namespace panonav
