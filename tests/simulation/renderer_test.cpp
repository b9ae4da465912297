#include "panonav/simulation/renderer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/random.hpp"

namespace panonav {
namespace {

// A quadrilateral of one colour, corners in order.
Mesh quadrilateral(int material, Vector3 a, Vector3 b, Vector3 c, Vector3 d) {
  Mesh mesh;
  mesh.object = "quadrilateral";
  mesh.material = material;
  mesh.vertices = {a, b, c, d};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

// A white board 2 m ahead (x = 2) from y = -0.5 to 0.5 in front of a black background, lit from
// everywhere.
Scene board_ahead() {
  Scene scene;
  scene.name = "board";
  scene.materials.push_back({.colour = {1.0F, 1.0F, 1.0F}, .texture = nullptr, .emission = 1.0F});
  scene.background = {0.0F, 0.0F, 0.0F};
  scene.meshes.push_back(
      quadrilateral(0, {2.0, -0.5, -5.0}, {2.0, 0.5, -5.0}, {2.0, 0.5, 5.0}, {2.0, -0.5, 5.0}));
  scene.floor_low = {-1.0, -1.0};
  scene.floor_high = {1.0, 1.0};
  return scene;
}

TEST(Renderer, AnEdgeAppearsAtItsAzimuth) {
  const Renderer renderer(board_ahead());
  Executor executor;
  const double heading = 0.3;
  const Panorama view = renderer.render_panorama(
      {.pose = {0.0, 0.0, heading}},
      {.rows = 3, .columns = 3600, .elevations = {-0.01, 0.01}, .rays_per_axis = 2}, executor);
  const double half_width = std::atan2(0.5, 2.0);
  int bright = 0;
  for (int c = 0; c < view.columns(); ++c) {
    const double from_middle = std::abs(angle_difference(view.azimuth_rad(c), -heading));
    const double column = 2.0 * std::numbers::pi / view.columns();
    if (from_middle < half_width - column) {
      EXPECT_FLOAT_EQ(view.at(1, c), 1.0F) << "column " << c;
      ++bright;
    } else if (from_middle > half_width + column) {
      EXPECT_FLOAT_EQ(view.at(1, c), 0.0F) << "column " << c;
    }
  }
  EXPECT_GT(bright, 200);
}

TEST(Renderer, DistanceIsThatOfTheSurface) {
  const Renderer renderer(board_ahead());
  EXPECT_NEAR(renderer.distance_along({0.0, 0.0, 0.5}, {1.0, 0.0, 0.0}), 2.0, 1e-5);
  EXPECT_NEAR(renderer.distance_along({0.5, 0.0, 0.5}, {2.0, 0.0, 0.0}), 1.5, 1e-5);
  EXPECT_TRUE(std::isinf(renderer.distance_along({0.0, 0.0, 0.5}, {-1.0, 0.0, 0.0})));
}

TEST(Renderer, TurningTheRobotShiftsColumns) {
  Scene scene = board_ahead();
  scene.meshes.push_back(
      quadrilateral(0, {-1.0, 1.0, -5.0}, {1.0, 1.0, -5.0}, {1.0, 1.0, 5.0}, {-1.0, 1.0, 5.0}));
  const Renderer renderer(scene);
  Executor executor;
  const PanoramaRendering rendering{.rows = 4, .columns = 128, .elevations = {-0.5, 0.5}};
  const Panorama before = renderer.render_panorama({.pose = {0.1, 0.2, 0.0}}, rendering, executor);
  const int columns = 37;
  const Panorama after = renderer.render_panorama(
      {.pose = {0.1, 0.2, 2.0 * std::numbers::pi * columns / 128.0}}, rendering, executor);
  const Panorama expected = turn_columns(before, columns);
  double sum = 0.0;
  for (std::size_t i = 0; i < after.values().size(); ++i) {
    sum += std::abs(after.values()[i] - expected.values()[i]);
  }
  // Rays that graze an edge may fall to the other side of it by rounding.
  EXPECT_LT(sum / static_cast<double>(after.values().size()), 1e-3);
  EXPECT_GT(*std::max_element(after.values().begin(), after.values().end()), 0.9F);
}

TEST(Renderer, ThreadsDoNotChangeABit) {
  const Renderer renderer(board_ahead());
  Executor one(1);
  Executor three(3);
  const Viewpoint viewpoint{.pose = {0.3, -0.1, 1.0}, .roll_rad = 0.05, .pitch_rad = -0.03};
  EXPECT_EQ(renderer.render_panorama(viewpoint, {.rows = 33, .columns = 100}, one),
            renderer.render_panorama(viewpoint, {.rows = 33, .columns = 100}, three));
}

TEST(SceneFromRobot, PitchLowersTheFrontAndRollTheRight) {
  const Viewpoint pitched{.pose = {0.0, 0.0, 0.0}, .pitch_rad = 0.1};
  EXPECT_LT(scene_from_robot(pitched, {1.0, 0.0, 0.0}).z, 0.0);
  const Viewpoint rolled{.pose = {0.0, 0.0, 0.0}, .roll_rad = 0.1};
  EXPECT_LT(scene_from_robot(rolled, {0.0, -1.0, 0.0}).z, 0.0);
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const Viewpoint any{.pose = {0.0, 0.0, random.uniform(-3.0, 3.0)},
                        .roll_rad = random.uniform(-0.3, 0.3),
                        .pitch_rad = random.uniform(-0.3, 0.3)};
    const Direction3 turned = scene_from_robot(any, {0.6, 0.48, 0.64});
    EXPECT_NEAR(turned.x * turned.x + turned.y * turned.y + turned.z * turned.z, 1.0, 1e-12);
  }
}

}  // namespace
}  // namespace panonav
