#include "panonav_simulation/paths.hpp"

#include <gtest/gtest.h>

#include <set>

namespace panonav::simulation {
namespace {

TEST(Paths, ResamplingKeepsShapeAndSpacing) {
  const std::vector<Pose2> path{{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {1.0, 1.0, 0.0}};
  const auto poses = resample(path, 0.1);
  ASSERT_EQ(poses.size(), 21U);
  EXPECT_NEAR(poses[5].x_m, 0.5, 1e-9);
  EXPECT_NEAR(poses[15].x_m, 1.0, 1e-9);
  EXPECT_NEAR(poses[15].y_m, 0.5, 1e-9);
  EXPECT_NEAR(poses[20].y_m, 1.0, 1e-9);
  EXPECT_EQ(resample(path, 5.0).size(), 1U);
  EXPECT_TRUE(resample({}, 0.1).empty());
  EXPECT_THROW((void)resample(path, 0.0), ContractError);
  EXPECT_THROW((void)resample(path, std::nan("")), ContractError);
  // A robot that stood still adds nothing.
  const std::vector<Pose2> waiting{{0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, {1.0, 0.0, 0.0}};
  EXPECT_EQ(resample(waiting, 0.25).size(), 5U);
}

TEST(Paths, GridIsCentredRegularAndComplete) {
  // [M04]: 10 x 8 places at 30 cm in 270 x 210 cm.
  const auto grid = grid_positions({0.0, 0.0}, {2.7, 2.1}, 0.3);
  ASSERT_EQ(grid.size(), 80U);
  EXPECT_EQ(grid.front().position, (Point2{0.0, 0.0}));
  EXPECT_NEAR(grid.back().position.x_m, 2.7, 1e-12);
  EXPECT_NEAR(grid.back().position.y_m, 2.1, 1e-12);
  std::set<std::pair<int, int>> seen;
  for (const auto& g : grid) {
    EXPECT_TRUE(seen.insert({g.j, g.i}).second);
    EXPECT_NEAR(g.position.x_m, 0.3 * g.i, 1e-12);
    EXPECT_NEAR(g.position.y_m, 0.3 * g.j, 1e-12);
  }
  const auto loose = grid_positions({0.0, 0.0}, {1.0, 0.4}, 0.3);
  ASSERT_EQ(loose.size(), 8U);
  EXPECT_NEAR(loose.front().position.x_m, 0.05, 1e-12);
  EXPECT_NEAR(loose.front().position.y_m, 0.05, 1e-12);
  EXPECT_THROW((void)grid_positions({1.0, 0.0}, {0.0, 1.0}, 0.3), ContractError);
  EXPECT_THROW((void)grid_positions({0.0, 0.0}, {1.0, 1.0}, 0.0), ContractError);
  EXPECT_THROW((void)grid_positions({0.0, 0.0}, {1.0, 1e9}, 0.3), ContractError);
}

TEST(Paths, ZigzagVisitsTheSamePlacesWithUnitSteps) {
  const auto raster = grid_positions({0.0, 0.0}, {2.0, 1.5}, 0.5);
  const auto zigzag = grid_positions({0.0, 0.0}, {2.0, 1.5}, 0.5, GridOrder::zigzag);
  ASSERT_EQ(zigzag.size(), 20U);
  for (std::size_t i = 1; i < zigzag.size(); ++i) {
    EXPECT_NEAR(distance(zigzag[i - 1].position, zigzag[i].position), 0.5, 1e-12);
  }
  for (const auto& g : raster) {
    EXPECT_NE(std::find(zigzag.begin(), zigzag.end(), g), zigzag.end());
  }
}

TEST(Paths, RandomWalkStaysInItsAreaAndRepeatsWithItsSeed) {
  const FreePredicate in_box = [](Point2 p) {
    return std::abs(p.x_m) < 1.0 && std::abs(p.y_m) < 0.7;
  };
  Random a(5), b(5), c(6);
  const auto walk = random_walk({}, in_box, {.poses = 2000}, a);
  ASSERT_EQ(walk.size(), 2000U);
  double widest = 0.0;
  for (std::size_t i = 0; i < walk.size(); ++i) {
    EXPECT_TRUE(in_box(walk[i].position()));
    widest = std::max(widest, std::abs(walk[i].x_m));
    if (i == 0) continue;
    const Pose2 step = inverse(walk[i - 1]) * walk[i];
    EXPECT_NEAR(std::hypot(step.x_m, step.y_m), 0.1, 1e-9);
    EXPECT_NEAR(std::atan2(step.y_m, step.x_m), step.heading_rad, 1e-9);
  }
  EXPECT_GT(widest, 0.8);  // guard: it does walk
  EXPECT_EQ(walk, random_walk({}, in_box, {.poses = 2000}, b));
  EXPECT_NE(walk, random_walk({}, in_box, {.poses = 2000}, c));
}

TEST(Paths, RandomWalkEndsWhereThereIsNoWay) {
  Random random(7);
  const auto walk = random_walk(
      {}, [](Point2 p) { return std::hypot(p.x_m, p.y_m) < 0.05; }, {}, random);
  EXPECT_EQ(walk.size(), 1U);
  EXPECT_THROW((void)random_walk(
                   {1.0, 0.0, 0.0}, [](Point2) { return false; }, {}, random),
               ContractError);
  EXPECT_THROW((void)random_walk(
                   {}, [](Point2) { return true; }, {.poses = 0}, random),
               ContractError);
  EXPECT_THROW((void)random_walk(
                   {}, [](Point2) { return true; }, {.step_m = 0.0}, random),
               ContractError);
}

}  // namespace
}  // namespace panonav::simulation
