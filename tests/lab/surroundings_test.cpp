#include "lab/m04/surroundings.hpp"
#include "panonav_viewer/scene_drawing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "lab/statistics.hpp"
#include "panonav/core/random.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/screen.hpp"

namespace panonav::lab {
namespace {

simulation::PlaceRecording small_office() {
  Executor executor(1);
  return simulation::record_place(
      {.seed = 3, .spacing_m = 1.0, .queries = 1, .rows = 12, .columns = 128}, executor);
}

TEST(Surroundings, SectorsAreCentredOnTheirDirections) {
  for (std::size_t i = 0; i < shape_directions; ++i) {
    const double azimuth = wrap_angle(static_cast<double>(i) * std::numbers::pi / 4.0);
    EXPECT_EQ(find_sector(azimuth), i);
    EXPECT_EQ(find_sector(azimuth + 0.38), i);
    EXPECT_EQ(find_sector(azimuth - 0.38), i);
  }
}

TEST(Surroundings, FreeDistanceIsThatToTheWallsOfAnEmptyRoom) {
  // A room of 8 x 4 m without furniture.
  simulation::PlaceRecording place;
  simulation::Scene& scene = place.scene;
  scene.materials = {simulation::Material{}};
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
  place.renderer = std::make_shared<const simulation::Renderer>(scene);
  const Surroundings around = measure_surroundings(place, {0.0, 0.0});
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
  const simulation::PlaceRecording place = small_office();
  const simulation::PanoramaRendering rendering{
      .rows = 40, .columns = 256, .elevations = place.rendering.elevations, .rays_per_axis = 3};
  const simulation::SensorOptions no_noise{
      .read_noise = 0.0, .full_well = 1e12, .eight_bit = false};
  constexpr int components = 3;
  std::vector<double> predicted;
  std::vector<double> measured;
  Random random(9);
  for (int i = 0; i < 10; ++i) {
    const Pose2 pose = place.free_space->random_pose(random);
    const Panorama view = simulation::capture_view(place, rendering, pose, 1, no_noise);
    const Directional extents = predict_extents(place, pose, view, components);
    for (std::size_t d = 0; d < shape_directions / 2; ++d) {
      const double theta = static_cast<double>(d) * std::numbers::pi / 4.0;
      constexpr double step_m = 0.02;
      const auto observe_after = [&](double way_m) {
        const Pose2 there{pose.x_m + way_m * std::cos(theta), pose.y_m + way_m * std::sin(theta),
                          pose.heading_rad};
        return compute_signature(simulation::capture_view(place, rendering, there, 1, no_noise),
                                 components);
      };
      // From one side to the other, so that what grows with the square of the step falls out.
      measured.push_back(dissimilarity_l1(observe_after(step_m), observe_after(-step_m)));
      predicted.push_back(1.0 / extents[d]);
      // A step back changes as much, to first order.
      EXPECT_NEAR(extents[d], extents[d + 4], 1e-9 * extents[d]);
    }
  }
  EXPECT_GT(rank_correlation(predicted, measured), 0.8);
}

/// Objects and walls of a drawn scene.
struct Drawn {
  explicit Drawn(const simulation::Scene& scene) {
    for (const viewer::MapLayer& layer : viewer::scene_layers(scene)) {
      things.insert(things.end(), layer.filled_polygons.begin(), layer.filled_polygons.end());
      walls.insert(walls.end(), layer.lines.begin(), layer.lines.end());
    }
  }
  std::vector<std::vector<Point2>> things;
  std::vector<std::vector<Point2>> walls;
};

TEST(SceneLayers, AnOfficeHasFurnitureAndWallsAllAround) {
  const simulation::Scene office = simulation::make_scene("office", {.seed = 3});
  const Drawn drawn(office);
  EXPECT_GE(drawn.things.size(), 5U);
  bool turned = false;
  for (const auto& outline : drawn.things) {
    ASSERT_GE(outline.size(), 3U);
    const auto [west, east] = std::ranges::minmax(outline, {}, &Point2::x_m);
    EXPECT_LE(east.x_m - west.x_m, 4.0);
    // A chair stands as it was left: not along the walls.
    const Point2 edge{outline[1].x_m - outline[0].x_m, outline[1].y_m - outline[0].y_m};
    turned = turned || (outline.size() == 4 && std::abs(edge.x_m * edge.y_m) > 1e-3);
  }
  EXPECT_TRUE(turned);
  double around_m = 0.0;
  for (const auto& line : drawn.walls) around_m += distance(line.front(), line.back());
  const double width = office.floor_high.x_m - office.floor_low.x_m;
  const double depth = office.floor_high.y_m - office.floor_low.y_m;
  EXPECT_GE(around_m, 2.0 * (width + depth));
}

TEST(SceneLayers, NoFurnitureReachesThroughAnOuterWall) {
  for (const auto* name : {"office", "loop"}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const Drawn drawn(simulation::make_scene(name, {.seed = seed}));
      Point2 low{1e9, 1e9};
      Point2 high{-1e9, -1e9};
      for (const auto& line : drawn.walls) {
        for (const Point2& p : line) {
          low = {std::min(low.x_m, p.x_m), std::min(low.y_m, p.y_m)};
          high = {std::max(high.x_m, p.x_m), std::max(high.y_m, p.y_m)};
        }
      }
      EXPECT_GE(drawn.things.size(), 5U);
      for (const auto& outline : drawn.things) {
        for (const Point2& p : outline) {
          EXPECT_TRUE(p.x_m > low.x_m - 1e-6 && p.x_m < high.x_m + 1e-6 && p.y_m > low.y_m - 1e-6 &&
                      p.y_m < high.y_m + 1e-6)
              << name << ' ' << seed << ": " << p.x_m << ' ' << p.y_m;
        }
      }
    }
  }
}

TEST(SceneLayers, AScreenIsALineAsItStands) {
  simulation::Scene scene{.floor_low = {-2.0, -2.0}, .floor_high = {2.0, 2.0}};
  const Pose2 across{0.5, 0.25, 0.6};
  simulation::add_screen(scene, across, 0.8, 1.0);
  const Drawn drawn(scene);
  EXPECT_TRUE(drawn.things.empty());
  ASSERT_EQ(drawn.walls.size(), 1U);
  const Point2 left = across * Point2{0.0, 0.4};
  const Point2 right = across * Point2{0.0, -0.4};
  EXPECT_NEAR(distance(drawn.walls[0].front(), left) + distance(drawn.walls[0].back(), right), 0.0,
              1e-9);
}

TEST(SceneLayers, CrownsOfTreesAreRound) {
  const Drawn drawn(simulation::make_scene("garden", {.seed = 1}));
  EXPECT_TRUE(
      std::ranges::any_of(drawn.things, [](const auto& outline) { return outline.size() >= 8; }));
}

TEST(SceneLayers, DoorsAreOpenUnderTheirLintels) {
  for (const auto* name : {"corridor", "loop"}) {
    const simulation::Scene scene = simulation::make_scene(name, {.seed = 1});
    const Drawn drawn(scene);
    ASSERT_GE(scene.tour.size(), 3U);
    for (std::size_t i = 0; i < scene.tour.size(); ++i) {
      const Point2 a = scene.tour[i];
      const Point2 b = scene.tour[(i + 1) % scene.tour.size()];
      const auto side = [](const Point2& p, const Point2& q, const Point2& r) {
        return (q.x_m - p.x_m) * (r.y_m - p.y_m) - (q.y_m - p.y_m) * (r.x_m - p.x_m);
      };
      for (const auto& wall : drawn.walls) {
        EXPECT_FALSE(side(a, b, wall.front()) * side(a, b, wall.back()) < 0.0 &&
                     side(wall.front(), wall.back(), a) * side(wall.front(), wall.back(), b) < 0.0)
            << name << " way " << i;
      }
    }
  }
}

}  // namespace
}  // namespace panonav::lab
