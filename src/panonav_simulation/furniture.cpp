#include "panonav_simulation/furniture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace panonav::simulation {

namespace {

/// Adds a lamp as large as a window, 0.8 m inside the room from the window's centre, which is at
/// the fraction `middle` of the wall.
void add_daylight(SceneBuilder& builder, Point2 from, Point2 to, double middle, double height_m) {
  const double length = distance(from, to);
  const double in_x = -(to.y_m - from.y_m) / length;
  const double in_y = (to.x_m - from.x_m) / length;
  builder.add_lamp({from.x_m + middle * (to.x_m - from.x_m) + 0.8 * in_x,
                    from.y_m + middle * (to.y_m - from.y_m) + 0.8 * in_y, height_m},
                   1.8F, 1.2F);
}

}  // namespace

void furnish_room_shell(SceneBuilder& builder, const FloorArea& room, double height_m) {
  Random& random = builder.random();
  const std::array<Point2, 4> corners{room.low, Point2{room.high.x_m, room.low.y_m}, room.high,
                                      Point2{room.low.x_m, room.high.y_m}};
  builder.add_floor(builder.add_textured_material(
                        noise_texture(random, 256, sample_colour(random, 0.25, 0.5, 0.15), 0.12)),
                    room.low, room.high, 1.5);
  builder.add_ceiling(builder.add_plain_material(sample_colour(random, 0.75, 0.9, 0.03)), room.low,
                      room.high, height_m, 1.0);
  // Windows are in one wall only, so the room is brighter on that side.
  const std::size_t outer_wall = random.index(4);
  for (std::size_t i = 0; i < 4; ++i) {
    const Point2 from = corners[i];
    const Point2 to = corners[(i + 1) % 4];
    const double length = distance(from, to);
    const std::string wall = "wall " + std::to_string(i);
    builder.add_wall(wall,
                     builder.add_textured_material(
                         noise_texture(random, 256, sample_colour(random, 0.45, 0.85, 0.12), 0.07)),
                     from, to, height_m, 2.5);
    builder.add_on_wall(wall + " skirting",
                        builder.add_plain_material(sample_colour(random, 0.1, 0.3, 0.1)), from, to,
                        0.0, length, 0.0, 0.08, 0.005);
    double along = random.uniform(0.2, 0.8);
    while (along < length - 0.6) {
      const double kind = random.uniform();
      double width = 0.0;
      const std::string name =
          wall + " picture at " + std::to_string(static_cast<int>(along * 100));
      if (i == outer_wall && kind < 0.7) {
        width = std::min(random.uniform(1.0, 1.6), length - along - 0.1);
        add_daylight(builder, from, to, (along + 0.5 * width) / length, 0.6 * height_m);
        const double bottom = random.uniform(0.8, 1.0);
        const int window = builder.add_textured_material(window_texture(random, 128), 1.0F);
        builder.add_on_wall(name, window, from, to, along, width, bottom,
                            std::min(height_m - 0.3, 2.1));
      } else if (i != outer_wall && kind < 0.25) {
        width = std::min(0.9, length - along - 0.1);
        builder.add_on_wall(name,
                            builder.add_textured_material(
                                door_texture(random, 128, sample_colour(random, 0.2, 0.7, 0.3))),
                            from, to, along, width, 0.0, 2.05);
      } else if (kind < 0.8) {
        width = std::min(random.uniform(0.5, 1.2), length - along - 0.1);
        const double bottom = random.uniform(0.7, 1.3);
        const double top = std::min(height_m - 0.2, bottom + width * random.uniform(0.7, 1.3));
        const int poster = builder.add_textured_material(poster_texture(random, 128));
        builder.add_on_wall(name, poster, from, to, along, width, bottom, top);
      } else {
        width = 0.4;
      }
      along += width + random.uniform(0.2, 0.9);
    }
  }
}

void add_desk(SceneBuilder& builder, const std::string& name, const Footing& footing) {
  Random& random = builder.random();
  const int wood = builder.add_textured_material(
      wood_texture(random, 128, vary_colour(random, builder.palette().wood)));
  const int metal = builder.add_plain_material(builder.palette().metal);
  builder.add_box(name, wood, wood, footing, {0.0, 0.0, 0.70}, {1.4, 0.7, 0.04}, 0.7);
  for (const double x : {-0.65, 0.65}) {
    for (const double y : {-0.30, 0.30}) {
      builder.add_box(name, metal, metal, footing, {x, y, 0.0}, {0.05, 0.05, 0.70});
    }
  }
  const int drawers = builder.add_textured_material(brick_texture(
      random, 128, 1, 3, vary_colour(random, builder.palette().paint), {0.1F, 0.1F, 0.1F}));
  const double side = random.uniform() < 0.5 ? -0.42 : 0.42;
  builder.add_box(name, drawers, wood, footing, {side, 0.0, 0.02}, {0.42, 0.6, 0.64});
  if (random.uniform() < 0.6) {
    builder.add_box(name, wood, wood, footing, {0.0, 0.32, 0.25}, {1.3, 0.02, 0.45}, 0.7);
  }
  const int screen = builder.add_textured_material(poster_texture(random, 64), 0.3F);
  const int dark = builder.add_plain_material({0.06F, 0.06F, 0.07F});
  builder.add_box(name, screen, dark, footing, {random.uniform(-0.3, 0.3), 0.1, 0.80},
                  {0.5, 0.06, 0.34});
  for (int i = 0; i < 3; ++i) {
    const int paper = builder.add_plain_material(sample_colour(random, 0.1, 0.95, 0.3));
    const Vector3 size{random.uniform(0.08, 0.3), random.uniform(0.08, 0.3),
                       random.uniform(0.02, 0.3)};
    const Vector3 at{random.uniform(-0.6, 0.6), random.uniform(-0.25, 0.25), 0.74};
    builder.add_box(name, paper, paper, footing, at, size);
  }
}

void add_chair(SceneBuilder& builder, const std::string& name, const Footing& footing) {
  Random& random = builder.random();
  const int cloth = builder.add_textured_material(
      noise_texture(random, 64, vary_colour(random, builder.palette().cloth, 0.2), 0.15));
  const int metal = builder.add_plain_material(builder.palette().metal);
  builder.add_box(name, cloth, cloth, footing, {0.0, 0.0, 0.43}, {0.45, 0.45, 0.07});
  builder.add_box(name, cloth, cloth, footing, {0.0, 0.21, 0.55}, {0.42, 0.05, 0.42});
  builder.add_cylinder(name, metal, footing.centre, 0.08, 0.43, 0.035, 8);
  for (int i = 0; i < 5; ++i) {
    const Footing leg{footing.centre, footing.turn_rad + 2.0 * std::numbers::pi * i / 5.0};
    builder.add_box(name, metal, metal, leg, {0.14, 0.0, 0.03}, {0.28, 0.04, 0.05});
  }
}

void add_shelf(SceneBuilder& builder, const std::string& name, const Footing& footing,
               double width_m, double height_m) {
  Random& random = builder.random();
  const int boards = std::max(2, static_cast<int>(height_m / 0.36));
  const int wood = builder.add_textured_material(
      wood_texture(random, 128, vary_colour(random, builder.palette().wood)));
  builder.add_box(name, wood, wood, footing, {0.0, 0.0, 0.0}, {width_m, 0.32, height_m}, 0.8);
  // Books are on both long sides, slightly in front of the wood.
  for (const double side : {-1.0, 1.0}) {
    const int books = builder.add_textured_material(bookshelf_texture(random, 256, boards));
    const Footing face{footing.centre, footing.turn_rad + (side > 0.0 ? std::numbers::pi : 0.0)};
    const double c = std::cos(face.turn_rad);
    const double s = std::sin(face.turn_rad);
    const auto corner = [&](double x, double z) {
      const double y = -0.165;
      return Vector3{face.centre.x_m + c * x - s * y, face.centre.y_m + s * x + c * y, z};
    };
    const double half = 0.5 * width_m - 0.02;
    builder.add_quadrilateral(name, books, corner(-half, 0.04), corner(half, 0.04),
                              corner(half, height_m - 0.04), corner(-half, height_m - 0.04),
                              std::max(1.0, std::round(width_m / 1.0)), 1.0);
  }
}

void add_wardrobe(SceneBuilder& builder, const std::string& name, const Footing& footing,
                  double width_m, double height_m) {
  Random& random = builder.random();
  const Colour colour = sample_colour(random, 0.08, 0.85, 0.2);
  const int front = builder.add_textured_material(noise_texture(random, 128, colour, 0.12, 2.5));
  const int gap =
      builder.add_plain_material({0.4F * colour[0], 0.4F * colour[1], 0.4F * colour[2]});
  builder.add_box(name, front, front, footing, {0.0, 0.0, 0.0}, {width_m, 0.45, height_m}, 1.6);
  // Gaps between the doors protrude slightly on both long sides.
  const int doors = std::max(2, static_cast<int>(width_m / 0.55));
  for (int i = 1; i < doors; ++i) {
    const double x = width_m * (static_cast<double>(i) / doors - 0.5);
    builder.add_box(name, gap, gap, footing, {x, 0.0, 0.06}, {0.012, 0.456, height_m - 0.12});
  }
}

void add_cabinet(SceneBuilder& builder, const std::string& name, const Footing& footing) {
  Random& random = builder.random();
  const Colour colour = vary_colour(random, builder.palette().paint, 0.15);
  const int front = builder.add_textured_material(
      brick_texture(random, 128, 1, 3 + static_cast<int>(random.index(2)), colour,
                    {0.5F * colour[0], 0.5F * colour[1], 0.5F * colour[2]}));
  const int top = builder.add_plain_material(colour);
  const double height = random.uniform(0.7, 1.5);
  builder.add_box(name, front, top, footing, {0.0, 0.0, 0.0},
                  {random.uniform(0.45, 0.9), 0.5, height});
  const int thing = builder.add_textured_material(poster_texture(random, 64));
  builder.add_box(name, thing, thing, footing, {0.0, 0.0, height},
                  {0.3, 0.3, random.uniform(0.15, 0.4)});
}

void add_plant(SceneBuilder& builder, const std::string& name, Point2 centre) {
  Random& random = builder.random();
  const int pot = builder.add_plain_material(sample_colour(random, 0.2, 0.6, 0.3));
  const int leaves =
      builder.add_textured_material(foliage_texture(random, 128, {0.2F, 0.38F, 0.15F}));
  builder.add_cylinder(name, pot, centre, 0.0, 0.3, 0.18, 12, 0.7);
  for (int i = 0; i < 9; ++i) {
    const Footing leaf{centre, random.uniform(-3.1, 3.1)};
    const Vector3 size{random.uniform(0.1, 0.25), 0.03, random.uniform(0.25, 0.6)};
    const Vector3 at{random.uniform(0.05, 0.18), 0.0, random.uniform(0.3, 0.7)};
    builder.add_box(name, leaves, leaves, leaf, at, size);
  }
}

void add_crate(SceneBuilder& builder, const std::string& name, const Footing& footing,
               Vector3 size) {
  Random& random = builder.random();
  const int side = builder.add_textured_material(
      random.uniform() < 0.5 ? wood_texture(random, 128, sample_colour(random, 0.3, 0.8, 0.25))
                             : poster_texture(random, 128));
  const int top = builder.add_plain_material(sample_colour(random, 0.2, 0.8, 0.2));
  builder.add_box(name, side, top, footing, {0.0, 0.0, 0.0}, size);
}

TreeKind make_tree_kind(SceneBuilder& builder) {
  Random& random = builder.random();
  const int bark =
      builder.add_textured_material(noise_texture(random, 64, {0.25F, 0.2F, 0.15F}, 0.25, 1.5));
  const float green = static_cast<float>(random.uniform(0.22, 0.42));
  const int leaves = builder.add_textured_material(
      foliage_texture(random, 256, {0.7F * green, green, 0.45F * green}));
  return {bark, leaves};
}

void add_tree(SceneBuilder& builder, const std::string& name, const TreeKind& kind, Point2 centre,
              double height_m) {
  Random& random = builder.random();
  const double trunk = 0.3 * height_m;
  builder.add_cylinder(name, kind.bark, centre, 0.0, trunk + 0.5,
                       0.05 * height_m * random.uniform(0.6, 1.0), 10, 1.3);
  // The crown consists of a few clumps of leaves at random offsets, so that each tree has its own
  // shape.
  const double crown = height_m - trunk;
  const int clumps = 4 + static_cast<int>(random.index(3));
  for (int i = 0; i < clumps; ++i) {
    const double share = (i + 0.5) / clumps;
    const double radius = crown * random.uniform(0.22, 0.36) * (1.15 - 0.5 * share);
    const Vector3 radii{radius, radius, radius * random.uniform(0.7, 1.0)};
    const Vector3 middle{centre.x_m + random.normal(0.0, 0.12 * crown),
                         centre.y_m + random.normal(0.0, 0.12 * crown),
                         trunk + crown * (0.15 + 0.75 * share)};
    builder.add_blob(name, kind.leaves, middle, radii, 0.13);
  }
}

}  // namespace panonav::simulation
