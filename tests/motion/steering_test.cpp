#include "panonav/motion/steering.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

TEST(Steering, ReachesGoalsFromAnywhere) {
  Random random(5);
  for (int trial = 0; trial < 50; ++trial) {
    Pose2 robot{random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0),
                random.uniform(-std::numbers::pi, std::numbers::pi)};
    const Point2 goal{random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0)};
    for (int step = 0; step < 300; ++step) robot = robot * steer_to(robot, goal);
    EXPECT_LT(distance(robot.position(), goal), 1e-3) << trial;
  }
}

TEST(Steering, ObeysItsLimits) {
  const SteeringOptions options{.turn_gain = 0.5, .max_turn_rad = 0.2, .step_m = 0.1};
  const Pose2 behind = steer_to({}, {-1.0, 0.01}, options);
  EXPECT_EQ(behind.x_m, 0.0);
  EXPECT_DOUBLE_EQ(behind.heading_rad, 0.2);
  const Pose2 ahead = steer_to({}, {1.0, 0.0}, options);
  EXPECT_DOUBLE_EQ(ahead.x_m, 0.1);
  const Pose2 near = steer_to({}, {0.05, 0.0}, options);
  EXPECT_DOUBLE_EQ(near.x_m, 0.04);
  EXPECT_THROW((void)steer_to({}, {}, {.step_m = 0.0}), OptionError);
}

// An eight: crosses itself.
std::vector<Point2> eight() {
  std::vector<Point2> path;
  for (int i = 0; i <= 400; ++i) {
    const double at = 2.0 * std::numbers::pi * i / 400.0;
    path.push_back({2.0 * std::sin(at), 2.0 * std::sin(at) * std::cos(at)});
  }
  return path;
}

double off_path_m(Point2 place, const std::vector<Point2>& path) {
  double least = std::numeric_limits<double>::infinity();
  for (const Point2 point : path) least = std::min(least, distance(point, place));
  return least;
}

TEST(PathFollower, RepeatsAPathThatCrossesItselfForwardAndBack) {
  for (const bool back : {false, true}) {
    auto path = eight();
    if (back) std::ranges::reverse(path);
    PathFollower follower(path);
    // 0.3 m beside the start, heading anywhere.
    Pose2 robot{0.2, -0.2, 2.5};
    double worst_m = 0.0;
    double before_m = 0.0;
    int steps = 0;
    for (; steps < 1000; ++steps) {
      const auto step = follower.next_step(robot);
      if (!step) break;
      robot = robot * *step;
      EXPECT_GE(follower.along_m(), before_m);
      before_m = follower.along_m();
      if (follower.along_m() > 1.0) {
        worst_m = std::max(worst_m, off_path_m(robot.position(), path));
      }
    }
    EXPECT_LT(steps, 400);
    EXPECT_GT(steps, static_cast<int>(0.95 * follower.length_m() / 0.05));  // it cuts corners
    EXPECT_NEAR(follower.along_m(), follower.length_m(), 0.1);
    EXPECT_LT(distance(robot.position(), path.back()), 0.05);
    EXPECT_LT(worst_m, 0.05) << back;
  }
}

// There may be a wall behind every corner.
TEST(PathFollower, CutsNoCorner) {
  // A zigzag of right angles.
  std::vector<Point2> path{{0.0, 0.0}};
  for (int corner = 0; corner < 6; ++corner) {
    for (int i = 0; i < 10; ++i) {
      const Point2 last = path.back();
      path.push_back(corner % 2 == 0 ? Point2{last.x_m + 0.1, last.y_m}
                                     : Point2{last.x_m, last.y_m + 0.1});
    }
  }
  const PathFollowerOptions options{.steering = {.step_m = 0.15}};
  PathFollower follower(path, options);
  Pose2 robot;
  double max_m = 0.0;
  int steps = 0;
  while (const auto step = follower.next_step(robot)) {
    ASSERT_LT(++steps, 500);
    const Pose2 there = robot * *step;
    for (int k = 1; k <= 4; ++k) {
      const Point2 between{robot.x_m + 0.25 * k * (there.x_m - robot.x_m),
                           robot.y_m + 0.25 * k * (there.y_m - robot.y_m)};
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t i = 1; i < path.size(); ++i) {
        for (int share = 0; share <= 10; ++share) {
          least = std::min(
              least,
              distance(between, {path[i - 1].x_m + 0.1 * share * (path[i].x_m - path[i - 1].x_m),
                                 path[i - 1].y_m + 0.1 * share * (path[i].y_m - path[i - 1].y_m)}));
        }
      }
      max_m = std::max(max_m, least);
    }
    robot = there;
  }
  EXPECT_LT(distance(robot.position(), path.back()), 0.03);
  EXPECT_GT(steps, 30);
  // A look-ahead of 0.3 m alone would cut by 0.1 m.
  EXPECT_LT(max_m, 0.06);
}

TEST(PathFollower, RefusesWhatIsNoPath) {
  const std::vector<Point2> one{{0.0, 0.0}};
  EXPECT_THROW(PathFollower{one}, ContractError);
  const std::vector<Point2> broken{{0.0, 0.0}, {std::nan(""), 0.0}};
  EXPECT_THROW(PathFollower{broken}, ContractError);
  const std::vector<Point2> same{{1.0, 0.0}, {1.0, 0.0}};
  EXPECT_FALSE(PathFollower{same}.next_step({1.0, 0.0, 0.0}));
}

}  // namespace
}  // namespace panonav
