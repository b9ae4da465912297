#include "lab/y03/steering.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "panonav/core/random.hpp"

namespace panonav::lab {
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
  EXPECT_DOUBLE_EQ(steer_to({}, {1.0, 0.0}, options).x_m, 0.1);
  EXPECT_DOUBLE_EQ(steer_to({}, {0.05, 0.0}, options).x_m, 0.04);
  EXPECT_THROW((void)steer_to({}, {}, {.step_m = 0.0}), ContractError);
}

}  // namespace
}  // namespace panonav::lab
