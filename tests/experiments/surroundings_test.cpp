#include "experiments/runs/surroundings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav {
namespace {

PlaceRecording small_office() {
  Executor executor(1);
  return record_place({.seed = 3, .spacing_m = 1.0, .queries = 1, .rows = 12, .columns = 128},
                      executor);
}

TEST(Surroundings, SectorsAreCentredOnTheirDirections) {
  for (std::size_t i = 0; i < shape_directions; ++i) {
    const double azimuth = wrap_angle(static_cast<double>(i) * std::numbers::pi / 4.0);
    EXPECT_EQ(sector_of(azimuth), i);
    EXPECT_EQ(sector_of(azimuth + 0.38), i);
    EXPECT_EQ(sector_of(azimuth - 0.38), i);
  }
}

TEST(Surroundings, FreeDistanceIsThatToTheWallsOfAnEmptyRoom) {
  // A room of 8 x 4 m without furniture.
  PlaceRecording place;
  Scene& scene = place.scene;
  scene.materials = {Material{}};
  const double x = 4.0;
  const double y = 2.0;
  const auto wall = [&](double ax, double ay, double bx, double by) {
    scene.meshes.push_back(
        {.object = "wall",
         .material = 0,
         .vertices = {{ax, ay, 0.0}, {bx, by, 0.0}, {bx, by, 3.0}, {ax, ay, 3.0}},
         .texture_coordinates = {},
         .triangles = {{0, 1, 2}, {0, 2, 3}}});
  };
  wall(-x, -y, x, -y);
  wall(x, -y, x, y);
  wall(x, y, -x, y);
  wall(-x, y, -x, -y);
  scene.floor_low = {-x, -y};
  scene.floor_high = {x, y};
  place.renderer = std::make_shared<const Renderer>(scene);
  const Surroundings around = surroundings_of(place, {0.0, 0.0});
  // Along the room the walls are farther than across; opposite directions are alike.
  EXPECT_NEAR(around.free_m[2], 2.1, 0.1);
  EXPECT_GT(around.free_m[0], 3.5);
  EXPECT_LT(around.free_m[0], 4.3);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(around.free_m[i], around.free_m[i + 4], 1e-6);
    EXPECT_NEAR(around.parallax_m[i], around.parallax_m[i + 4], 1e-6);
  }
  // The near walls are abeam of a way along the room: it changes the view more.
  EXPECT_LT(around.parallax_m[0], around.parallax_m[2]);
}

// The prediction against the renderer, with views as large as the experiment's: the change of the
// first magnitudes after a short step there and back.
TEST(PredictedExtents, AgreeWithStepsThatAreReallyTaken) {
  const PlaceRecording place = small_office();
  const PanoramaRendering rendering{
      .rows = 40, .columns = 256, .elevations = place.rendering.elevations, .rays_per_axis = 3};
  const SensorOptions no_noise{.read_noise = 0.0, .full_well = 1e12, .eight_bit = false};
  constexpr int components = 3;
  std::vector<double> predicted;
  std::vector<double> taken;
  Random random(9);
  for (int i = 0; i < 10; ++i) {
    const Pose2 pose = place.free_space->random_pose(random);
    const Panorama view = take_view(place, rendering, pose, 1, no_noise);
    const Directional extents = predicted_extents(place, pose, view, components);
    for (std::size_t d = 0; d < shape_directions / 2; ++d) {
      const double theta = static_cast<double>(d) * std::numbers::pi / 4.0;
      constexpr double kStepM = 0.02;
      const auto seen_after = [&](double step_m) {
        const Pose2 there{pose.x_m + step_m * std::cos(theta), pose.y_m + step_m * std::sin(theta),
                          pose.heading_rad};
        return compute_signature(take_view(place, rendering, there, 1, no_noise), components);
      };
      // From one side to the other, so that what grows with the square of the step falls out.
      taken.push_back(dissimilarity_l1(seen_after(kStepM), seen_after(-kStepM)));
      predicted.push_back(1.0 / extents[d]);
      // A step back changes as much, to first order.
      EXPECT_NEAR(extents[d], extents[d + 4], 1e-9 * extents[d]);
    }
  }
  EXPECT_GT(rank_correlation(predicted, taken), 0.8);
}

TEST(FurnitureLayers, HoldWhatStandsOnTheFloorAndNoWalls) {
  const PlaceRecording place = small_office();
  const auto layers = furniture_layers(place.scene);
  ASSERT_EQ(layers.size(), 2U);
  std::size_t pieces = 0;
  for (const MapLayer& layer : layers) {
    for (const auto& outline : layer.filled_polygons) {
      ++pieces;
      const auto [low, high] = std::ranges::minmax(outline, {}, &Point2::x_m);
      EXPECT_LT(high.x_m - low.x_m, 4.0);
    }
  }
  EXPECT_GE(pieces, 5U);
}

}  // namespace
}  // namespace panonav
