// Scenes of the size of flights, in which homes are learnt.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "lab/s06/home_areas.hpp"
#include "panonav/core/error.hpp"
#include "panonav_simulation/furniture.hpp"
#include "panonav_simulation/scenes.hpp"

namespace panonav::lab {

namespace {

using simulation::Scene;
using simulation::SceneBuilder;

constexpr double half_size_m = 20.0;

Scene make_forest(std::uint64_t seed) {
  SceneBuilder builder("forest", {.seed = seed});
  Random& random = builder.random();
  builder.scene().floor_low = {-half_size_m, -half_size_m};
  builder.scene().floor_high = {half_size_m, half_size_m};
  builder.scene().ambient = 0.7F;
  builder.scene().directional_lights.push_back(
      {Direction3::from_angles(random.uniform(-std::numbers::pi, std::numbers::pi), 0.8), 0.8F});
  const int soil = builder.add_textured_material(
      simulation::noise_texture(random, 256, {0.3F, 0.28F, 0.18F}, 0.25, 1.2));
  builder.add_floor(soil, {-160.0, -160.0}, {160.0, 160.0}, 3.0);
  std::array<simulation::TreeKind, 6> kinds;
  for (simulation::TreeKind& kind : kinds) kind = simulation::make_tree_kind(builder);
  // Trees stand beyond the floor too, so that there is a forest at its edge as well.
  constexpr double tree_area_m2 = 15.0;
  constexpr double reach_m = half_size_m + 10.0;
  const auto trees = static_cast<int>(4.0 * reach_m * reach_m / tree_area_m2);
  for (int i = 0; i < trees; ++i) {
    const Point2 place{random.uniform(-reach_m, reach_m), random.uniform(-reach_m, reach_m)};
    simulation::add_tree(builder, "tree " + std::to_string(i), kinds[random.index(kinds.size())],
                         place, random.uniform(3.0, 9.0));
  }
  return builder.finish();
}

Scene make_wide_garden(std::uint64_t seed) {
  Scene scene = simulation::make_scene("garden", {.seed = seed});
  const Point2 middle{6.0, 5.0};
  scene.floor_low = {middle.x_m - half_size_m, middle.y_m - half_size_m};
  scene.floor_high = {middle.x_m + half_size_m, middle.y_m + half_size_m};
  return scene;
}

Scene make_industrial_hall(std::uint64_t seed) {
  SceneBuilder builder("industrial_hall", {.seed = seed});
  Scene& scene = builder.scene();
  Random& random = builder.random();
  scene.floor_low = {-half_size_m, -half_size_m};
  scene.floor_high = {half_size_m, half_size_m};
  scene.ambient = 0.5F;
  const simulation::FloorArea room{{-half_size_m - 1.0, -half_size_m - 1.0},
                                   {half_size_m + 1.0, half_size_m + 1.0}};
  constexpr double height_m = 7.0;
  simulation::furnish_room_shell(builder, room, height_m);
  for (double x = -15.0; x <= 15.0; x += 10.0) {
    for (double y = -15.0; y <= 15.0; y += 10.0) builder.add_lamp({x, y, height_m - 0.5}, 12.0F);
  }
  // Rows of shelves with gaps; crates and wardrobes between them.
  int number = 0;
  for (double y = -16.0; y <= 16.0; y += 8.0) {
    for (double x = -15.0; x <= 15.0; x += 6.0) {
      const simulation::Footing footing{
          {x + random.uniform(-1.0, 1.0), y + random.uniform(-1.5, 1.5)},
          random.uniform(-0.3, 0.3)};
      const std::string name = "thing " + std::to_string(number++);
      switch (random.index(5)) {
        case 0:
        case 1:
          simulation::add_shelf(builder, name, footing, random.uniform(2.0, 4.0),
                                random.uniform(2.0, 4.5));
          break;
        case 2:
          simulation::add_crate(
              builder, name, footing,
              {random.uniform(0.8, 2.5), random.uniform(0.8, 2.0), random.uniform(0.7, 2.5)});
          break;
        case 3:
          simulation::add_wardrobe(builder, name, footing, random.uniform(1.0, 2.5),
                                   random.uniform(1.5, 3.0));
          break;
        default:
          break;
      }
    }
  }
  return builder.finish();
}

}  // namespace

std::vector<std::string> list_home_scenes() {
  return {"forest", "garden", "industrial_hall"};
}

Scene make_home_scene(const std::string& name, std::uint64_t seed) {
  if (name == "forest") return make_forest(seed);
  if (name == "garden") return make_wide_garden(seed);
  if (name == "industrial_hall") return make_industrial_hall(seed);
  throw ContractError("scene of a home", name, "forest, garden, industrial_hall");
}

}  // namespace panonav::lab
