#include "panonav/motion/path_follower.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/motion/velocity.hpp"

namespace panonav {
namespace {

// An eight: crosses itself.
std::vector<Point2> eight() {
  std::vector<Point2> path;
  for (int i = 0; i <= 400; ++i) {
    const double at = 2.0 * std::numbers::pi * i / 400.0;
    path.push_back({2.0 * std::sin(at), 2.0 * std::sin(at) * std::cos(at)});
  }
  return path;
}

/// Moves the robot by steps of up to `step_m`; false when it has arrived.
bool follow(PathFollower& follower, Pose2& robot, double step_m = 0.05) {
  const auto target = follower.next_target(robot.position());
  if (!target) return false;
  const Point2 ahead = inverse(robot) * *target;
  const BaseOptions base{.speed_m_s = 10.0 * step_m, .turn_rad_s = 5.0, .on_spot_rad = 0.5};
  robot =
      robot * integrate_velocity(compute_command_towards(std::atan2(ahead.y_m, ahead.x_m),
                                                         std::hypot(ahead.x_m, ahead.y_m), base),
                                 base.period_s);
  return true;
}

double off_path_m(Point2 place, const std::vector<Point2>& path) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const Point2 point : path) nearest_m = std::min(nearest_m, distance(point, place));
  return nearest_m;
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
    for (; steps < 1000 && follow(follower, robot); ++steps) {
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
  PathFollower follower(path);
  Pose2 robot;
  double max_m = 0.0;
  int steps = 0;
  for (Pose2 there = robot; follow(follower, there, 0.15);) {
    ASSERT_LT(++steps, 500);
    for (int k = 1; k <= 4; ++k) {
      const Point2 between{robot.x_m + 0.25 * k * (there.x_m - robot.x_m),
                           robot.y_m + 0.25 * k * (there.y_m - robot.y_m)};
      double nearest_m = std::numeric_limits<double>::infinity();
      for (std::size_t i = 1; i < path.size(); ++i) {
        for (int share = 0; share <= 10; ++share) {
          nearest_m = std::min(
              nearest_m,
              distance(between, {path[i - 1].x_m + 0.1 * share * (path[i].x_m - path[i - 1].x_m),
                                 path[i - 1].y_m + 0.1 * share * (path[i].y_m - path[i - 1].y_m)}));
        }
      }
      max_m = std::max(max_m, nearest_m);
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
  EXPECT_FALSE(PathFollower{same}.next_target({1.0, 0.0}));
}

}  // namespace
}  // namespace panonav
