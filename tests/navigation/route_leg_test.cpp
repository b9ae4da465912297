#include "panonav/navigation/route_leg.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/motion/steering.hpp"
#include "panonav/motion/velocity.hpp"
#include "route/textured_room.hpp"

namespace panonav {
namespace {

constexpr double pi = std::numbers::pi;

struct RecordedRoute {
  testing::TexturedRoom room{31};
  std::vector<Pose2> path;
  RoutePanorama route;

  RecordedRoute() {
    path = smooth_path(std::vector<Point2>{{-3, -0.8}, {-1.2, 0.5}, {0.6, -0.3}, {2.8, 0.6}},
                       {.spacing_m = 0.1});
    for (const Pose2& pose : path) route.append(pose, room.line(pose));
  }
  [[nodiscard]] double way_m(std::size_t from, std::size_t to) const {
    double way = 0.0;
    for (std::size_t i = from; i < to; ++i) {
      way += distance(path[i].position(), path[i + 1].position());
    }
    return way;
  }
};

TEST(RouteLeg, LeadsAlongTheRouteInBothDirections) {
  const RecordedRoute recorded;
  const RouteTracker tracker(recorded.route);
  Random random(4);
  int found = 0;
  constexpr int trials = 20;
  for (int trial = 0; trial < trials; ++trial) {
    const std::size_t first = 3 + random.index(15);
    const std::size_t last = 30 + random.index(recorded.path.size() - 33);
    const bool back = trial % 2 == 1;
    const Pose2 low =
        recorded.path[first] * Pose2{0.0, random.uniform(-0.2, 0.2), random.uniform(-pi, pi)};
    const Pose2 high =
        recorded.path[last] * Pose2{0.0, random.uniform(-0.2, 0.2), random.uniform(-pi, pi)};
    const Pose2& robot = back ? high : low;
    const Pose2& goal = back ? low : high;
    const auto leg = route_leg(tracker, recorded.room.line(robot), recorded.room.line(goal));
    if (!leg) continue;
    ++found;
    EXPECT_EQ(leg->back, back);
    EXPECT_NEAR(leg->length_m, recorded.way_m(first, last), 0.15);
    EXPECT_LT(distance(leg->route_from_robot.position(), robot.position()), 0.1);
    EXPECT_LT(distance(leg->path.back(), goal.position()), 0.1);
    ASSERT_GT(leg->path.size(), 10U);
    // Neighbours on the route stay neighbours, and the way has the route's length.
    double length = 0.0;
    for (std::size_t i = 0; i + 1 < leg->path.size(); ++i) {
      const double step = distance(leg->path[i], leg->path[i + 1]);
      EXPECT_LT(step, 0.35);
      if (i + 2 < leg->path.size()) length += step;
    }
    EXPECT_NEAR(length, leg->length_m, 1e-9);
  }
  EXPECT_GE(found, trials * 9 / 10);
}

// Line in, command out, with the wheels' errors; the robot ends at the goal.
TEST(RouteLeg, IsDrivenByCommands) {
  const RecordedRoute recorded;
  RouteTracker tracker(recorded.route);
  const Pose2 start = recorded.path[4] * Pose2{0.0, 0.1, 0.2};
  const Pose2 goal = recorded.path[45] * Pose2{0.0, -0.1, 0.0};
  const auto leg = route_leg(tracker, recorded.room.line(start), recorded.room.line(goal));
  ASSERT_TRUE(leg.has_value());
  tracker.set_pose(leg->route_from_robot);
  PathFollower follower(leg->path);
  Random random(3);
  Pose2 robot = start;
  Pose2 moved;
  bool arrived = false;
  for (int step = 0; step < 300 && !arrived; ++step) {
    static_cast<void>(tracker.track(recorded.room.line(robot), moved));
    ASSERT_TRUE(tracker.pose().has_value());
    const auto next = follower.next_step(*tracker.pose());
    arrived = !next;
    if (arrived) break;
    moved = motion_after(velocity_for(*next, 0.1), 0.1);
    robot = robot * sample_step(moved, {}, random);
  }
  EXPECT_TRUE(arrived);
  EXPECT_LT(distance(robot.position(), goal.position()), 0.1);
}

TEST(RouteLeg, SaysWhereNoRouteLeads) {
  const RecordedRoute recorded;
  const RouteTracker tracker(recorded.route);
  const auto on_route = recorded.room.line(recorded.path[5]);
  const auto goal = recorded.room.line(recorded.path[40]);
  ASSERT_TRUE(route_leg(tracker, on_route, goal).has_value());
  EXPECT_FALSE(route_leg(tracker, on_route, recorded.room.line(recorded.path[7])).has_value());
  const testing::TexturedRoom other(777);
  EXPECT_FALSE(route_leg(tracker, other.line({0.3, 0.4, 1.0}), goal).has_value());
  const auto beside = recorded.room.line(recorded.path[20] * Pose2{0.0, 0.35, 0.0});
  EXPECT_FALSE(route_leg(tracker, beside, goal, {.reach_m = 0.1}).has_value());
  EXPECT_THROW((void)route_leg(tracker, std::vector<float>(7), goal), ContractError);
  EXPECT_THROW((void)route_leg(tracker, on_route, goal, {.reach_m = -1.0}), OptionError);
}

}  // namespace
}  // namespace panonav
