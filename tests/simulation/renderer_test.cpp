#include "panonav_simulation/renderer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::simulation {
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

TEST(Renderer, AnEdgeIsPlacedToAFractionOfAColumn) {
  const Renderer renderer(board_ahead());
  Executor executor;
  const int n = 4;
  const double edge = std::atan2(0.5, 2.0);
  for (int columns = 100; columns < 110; ++columns) {
    const Panorama view = renderer.render_panorama(
        {.pose = {0.0, 0.0, 0.0}},
        {.rows = 1, .columns = columns, .elevations = {-0.01, 0.01}, .rays_per_axis = n}, executor);
    // The column that the edge falls into is bright up to the edge.
    const double at = edge * columns / (2.0 * std::numbers::pi) + 0.5;
    const int column = static_cast<int>(at);
    EXPECT_NEAR(view.at(0, column), at - column, 1.0 / (n * n)) << columns << " columns";
  }
}

TEST(Renderer, LightFollowsLambertAndTheDistance) {
  Scene scene = board_ahead();
  scene.materials[0].emission = 0.0F;
  scene.materials[0].colour = {0.5F, 0.5F, 0.5F};
  scene.ambient = 0.1F;
  scene.lights.push_back({{0.0, 0.0, 0.5}, 1.5F, 0.0F});
  const Renderer renderer(scene);
  // Straight ahead the board is 2 m from the lamp; 4.5 m above, the light falls at a slant. The
  // board's light is interpolated between points, hence the tolerance.
  const auto expected = [](double height) {
    const double squared = 4.0 + height * height;
    return 0.5 * (0.1 + 1.5 / squared * 2.0 / std::sqrt(squared));
  };
  EXPECT_NEAR(renderer.radiance_along({0.0, 0.0, 0.5}, {1.0, 0.0, 0.0}, 0.0), expected(0.0), 5e-3);
  EXPECT_NEAR(renderer.radiance_along({0.0, 0.0, 4.5}, {1.0, 0.0, 0.0}, 0.0), expected(4.0), 5e-3);
  // The far side sees the ambient light alone.
  EXPECT_NEAR(renderer.radiance_along({4.0, 0.0, 0.5}, {-1.0, 0.0, 0.0}, 0.0), 0.05, 1e-3);
}

TEST(Renderer, AScreenCastsAShadowUnlessShadowsAreOff) {
  Scene scene = board_ahead();
  scene.materials[0].emission = 0.0F;
  scene.ambient = 0.0F;
  scene.lights.push_back({{0.0, 0.0, 0.5}, 2.0F, 0.0F});
  scene.meshes.push_back(
      quadrilateral(0, {1.0, -2.0, 0.0}, {1.0, 2.0, 0.0}, {1.0, 2.0, 1.0}, {1.0, -2.0, 1.0}));
  const Direction3 ahead{1.0, 0.0, 0.0};
  const Vector3 behind_screen{1.5, 0.0, 0.5};
  const Vector3 above_shadow{1.5, 0.0, 3.0};
  const Renderer with(scene);
  const Renderer without(scene, {.shadows = false});
  EXPECT_EQ(with.radiance_along(behind_screen, ahead, 0.0), 0.0F);
  EXPECT_GT(without.radiance_along(behind_screen, ahead, 0.0), 0.3F);
  EXPECT_NEAR(with.radiance_along(above_shadow, ahead, 0.0),
              without.radiance_along(above_shadow, ahead, 0.0), 1e-6);
}

TEST(Renderer, FarTexturesAreAveragedNotSampled) {
  // A checkerboard of one-texel fields, seen from so far that a pixel covers many of them.
  Image fields(64, 64, 1);
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 64; ++u) fields.at(u, v) = (u + v) % 2 == 0 ? 255 : 0;
  }
  Scene scene = board_ahead();
  scene.materials[0].texture = std::make_shared<const Image>(std::move(fields));
  scene.meshes[0].texture_coordinates = {{0.0F, 0.0F}, {1.0F, 0.0F}, {1.0F, 10.0F}, {0.0F, 10.0F}};
  const Renderer renderer(scene);
  Random random(8);
  for (int i = 0; i < 50; ++i) {
    const Vector3 from{-3.0, random.uniform(-0.3, 0.3), random.uniform(-1.0, 1.0)};
    EXPECT_NEAR(renderer.radiance_along(from, {1.0, 0.0, 0.0}, 0.02), 0.5, 0.01);
  }
}

TEST(Renderer, EquirectangularPictureShowsThePanoramaMirrored) {
  Scene scene = board_ahead();
  scene.meshes.push_back(
      quadrilateral(0, {-1.0, 1.0, -0.3}, {1.0, 1.0, -0.3}, {1.0, 1.0, 0.4}, {-1.0, 1.0, 0.4}));
  const Renderer renderer(scene);
  Executor executor;
  const Viewpoint viewpoint{.pose = {0.1, -0.2, 0.4}};
  Camera camera;
  camera.model = EquirectangularModel{-0.5, 0.5};
  camera.image_size = {128, 32};
  camera.direction = ColumnDirection::clockwise;
  camera.forward_column = 0.5 / 128.0;  // the middle of the first column looks ahead
  const Image picture = to_image(renderer.render_image(viewpoint, camera, 2, executor));
  const Panorama panorama = renderer.render_panorama(
      viewpoint, {.rows = 32, .columns = 128, .elevations = {-0.5, 0.5}, .rays_per_axis = 2},
      executor);
  int bright = 0;
  for (int v = 0; v < 32; ++v) {
    for (int u = 0; u < 128; ++u) {
      const float expected = panorama.at(v, (128 - u) % 128);
      bright += expected > 0.9F ? 1 : 0;
      // An edge through the pixel may be counted by other rays: a mirrored pattern of them.
      EXPECT_NEAR(picture.at(u, v) / 255.0, expected, 0.26) << u << " " << v;
    }
  }
  EXPECT_GT(bright, 100);
}

TEST(Renderer, RefusesWhatItCannotDraw) {
  const Renderer renderer(board_ahead());
  Executor executor;
  EXPECT_THROW((void)renderer.render_panorama({}, {.rays_per_axis = 0}, executor), ContractError);
  EXPECT_THROW((void)renderer.render_panorama({.pose = {std::nan(""), 0.0, 0.0}}, {}, executor),
               ContractError);
  EXPECT_THROW((void)renderer.render_panorama({.pose = {1e300, 0.0, 0.0}}, {}, executor),
               ContractError);
  EXPECT_THROW((void)renderer.render_panorama({.height_m = -1e30}, {}, executor), ContractError);
  EXPECT_THROW((void)renderer.render_panorama({}, {.elevations = {std::nan(""), 0.1}}, executor),
               ContractError);
  EXPECT_THROW((void)renderer.radiance_along({}, {0.0, 0.0, 0.0}, 0.0), ContractError);
  EXPECT_THROW((void)renderer.distance_along({0.0, std::nan(""), 0.0}, {1.0, 0.0, 0.0}),
               ContractError);
  EXPECT_THROW((void)renderer.distance_along({0.0, 1e40, 0.0}, {1.0, 0.0, 0.0}), ContractError);
  EXPECT_THROW(Renderer(board_ahead(), {.channels = 2}), ContractError);
  Scene broken = board_ahead();
  broken.meshes[0].triangles.push_back({0, 1, 9});
  EXPECT_THROW(Renderer{broken}, ContractError);
  broken = board_ahead();
  broken.meshes[0].vertices[1].z_m = 1e39;
  EXPECT_THROW(Renderer{broken}, ContractError);
}

TEST(Renderer, AnEmptySceneIsBackground) {
  Scene scene;
  scene.background = {0.25F, 0.25F, 0.25F};
  EXPECT_NEAR(Renderer(scene).radiance_along({}, {1.0, 0.0, 0.0}, 0.0), 0.25, 1e-6);
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
  const Panorama expected = rotate_columns(before, columns);
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
}  // namespace panonav::simulation
