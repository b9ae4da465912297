#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>

#include "lab/experiments.hpp"
#include "lab/reproduction.hpp"
#include "lab/y03/routes.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav_simulation/line_camera.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/scenes.hpp"
#include "support/skips.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::lab {
using namespace testing;
namespace {

TEST(LineCamera, SeesTheHorizonOfTheWholePicture) {
  const simulation::Renderer renderer(simulation::make_scene("lab", {.seed = 5}));
  simulation::LineCamera camera = simulation::make_line_camera(0.6);
  const Pose2 pose{3.1, 2.4, 0.7};
  const auto noisy = simulation::capture_line(renderer, pose, camera, 3);
  EXPECT_EQ(noisy, simulation::capture_line(renderer, pose, camera, 3));
  EXPECT_NE(noisy, simulation::capture_line(renderer, pose, camera, 4));
  camera.sensor.read_noise = 0.0;
  camera.sensor.full_well = 1e12;
  Executor executor(1);
  const Image picture = simulation::capture_image(
      renderer, pose, camera.camera, {.camera_height_m = 0.6}, camera.sensor, 1, executor);
  const auto whole = horizon_scanline(camera.unwarper.unwrap(picture.view()), camera.line);
  const auto line = simulation::capture_line(renderer, pose, camera, 1);
  ASSERT_EQ(line.size(), 360U);
  double off = 0.0;
  for (std::size_t c = 0; c < line.size(); ++c) {
    // A grey level where a value is rounded the other way.
    EXPECT_NEAR(line[c], whole[c], 1.0 / 255.0);
    off += std::abs(line[c] - noisy[c]) / 360.0;
  }
  EXPECT_GT(off, 0.0003);
  EXPECT_LT(off, 0.005);
}

TEST(RouteRuns, ACurvedRouteIsRepeatedWithPoorWheels) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor executor(2);
  const RouteScene place =
      make_route_scene(simulation::make_scene("loop", {.seed = 6}), "loop", executor);
  const auto way = plan_curved_route(place, 4.0, 0.1, 3);
  ASSERT_GE(way.size(), 30U);
  EXPECT_LE(way.size(), 41U);
  for (std::size_t i = 1; i < way.size(); ++i) {
    EXPECT_NEAR(distance(way[i - 1].position(), way[i].position()), 0.1, 0.02);
  }
  const RouteTracker tracker(record_route(place, way, 4, executor));
  for (const bool back : {false, true}) {
    const RouteRun run = repeat_route(place, tracker, {.back = back}, 9);
    EXPECT_TRUE(run.has_completed());
    EXPECT_NEAR(run.lateral_m.front(), 0.3, 0.02);
    EXPECT_LT(run.lateral_m.back(), 0.05);
    EXPECT_LT(4 * run.off_route, run.truth.size());
  }
  EXPECT_THROW((void)plan_curved_route(place, 0.0, 0.1, 1), ContractError);
}

TEST(RouteReproduction, TheFitIsBetterThanTheContoursAndMaskingHelps) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const TemporaryFolder folder;
  Executor executor(2);
  Reproduction result{.out = folder.path()};
  const ReproductionOptions options{.seed = 711, .scenes = 1, .runs = 2, .swept = 1};
  RouteExperiments{{options, executor, result}}.reproduce_lab_drives();
  std::map<std::string, double> ours;
  for (const ResultRow& row : result.rows) {
    EXPECT_TRUE(std::isfinite(row.ours)) << row.id;
    EXPECT_TRUE(ours.emplace(row.id, row.ours).second) << row.id;
  }
  EXPECT_GT(result.rows.size(), 35U);
  EXPECT_LT(ours.at("y03.straight.fit.error"), 0.5 * ours.at("y03.straight.contours.error"));
  EXPECT_LT(ours.at("y03.straight.fit.error"), 0.5);
  EXPECT_LT(ours.at("y03.straight.contours.error"), 4.0);
  EXPECT_LT(ours.at("y03.changed.fit.error"), ours.at("y03.changed.plain.error"));
  EXPECT_GE(ours.at("y03.changed.share"), 5.0);
  EXPECT_LE(ours.at("y03.changed.share"), 15.0);
  EXPECT_LT(ours.at("y03.goal.error"), 2.0);
  EXPECT_GE(result.pictures.size(), 7U);
  for (const auto& picture : result.pictures) {
    EXPECT_GT(std::filesystem::file_size(folder.path() / picture.file), 2000U) << picture.file;
  }
}

}  // namespace
}  // namespace panonav::lab
