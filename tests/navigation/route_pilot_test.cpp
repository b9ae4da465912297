#include "panonav/navigation/internal/route_pilot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/route/route_position.hpp"
#include "support/smooth_path.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

constexpr double step_m = 0.25;
constexpr double shortest_m = 0.75;

// A route through a room and a view every 0.3 m along it.
struct RecordedRoute {
  ToyWorld room = pillared_room(31);
  std::vector<Pose2> path;
  std::vector<ViewId> views;
  std::vector<KnownRoute> known;

  RecordedRoute() {
    path = smooth_path(std::vector<Point2>{{-3, -0.8}, {-1.2, 0.5}, {0.6, -0.3}, {2.8, 0.6}}, 0.1);
    RoutePanorama route;
    std::vector<KnownRoute::View> placed;
    for (std::size_t i = 0; i < path.size(); ++i) {
      route.append(path[i], room.line(path[i]));
      if (i % 3 != 0) continue;
      views.push_back(ViewId{static_cast<std::uint32_t>(i / 3)});
      placed.push_back({views.back(), path[i]});
    }
    // Learning it takes longer than the rest.
    known.push_back(make_known_route(route, placed, {.tracker = {.min_correlation = 0.7}}));
  }
  [[nodiscard]] const Pose2& pose_of(ViewId view) const { return path[3 * view.value]; }
  [[nodiscard]] std::vector<ViewId> way(std::size_t from, std::size_t to) const {
    std::vector<ViewId> way(views.begin() + static_cast<std::ptrdiff_t>(std::min(from, to)),
                            views.begin() + static_cast<std::ptrdiff_t>(std::max(from, to)) + 1);
    if (to < from) std::ranges::reverse(way);
    return way;
  }
};

const RecordedRoute& recorded() {
  static const RecordedRoute route;
  return route;
}

// A robot turns towards the aim and drives; the wheels have their errors.
struct Robot {
  Pose2 pose;
  Random random{5};

  Pose2 go(Point2 aim) {
    const double way_m = std::min(step_m, std::hypot(aim.x_m, aim.y_m));
    const double turn_rad = std::atan2(aim.y_m, aim.x_m);
    const Pose2 turn{0.0, 0.0, turn_rad};
    const Pose2 ahead{way_m, 0.0, 0.0};
    pose = pose * sample_step(turn, {}, random) * sample_step(ahead, {}, random);
    return turn * ahead;
  }
};

TEST(RoutePilot, DrivesToTheEndOfTheWayInBothDirections) {
  const RecordedRoute& route = recorded();
  for (const bool back : {false, true}) {
    RoutePilot pilot(route.known);
    const std::size_t last = route.views.size() - 2;
    const auto way = back ? route.way(last, 1) : route.way(1, last);
    Robot robot{route.pose_of(way.front()) * Pose2{0.05, 0.15, back ? 2.0 : -1.0}};
    ASSERT_TRUE(pilot.begin_leg(way, route.room.line(robot.pose), shortest_m));
    EXPECT_EQ(pilot.end(), way.back());
    int steps = 0;
    for (; pilot.target() && steps < 100; ++steps) {
      const Pose2 moved = robot.go(*pilot.target());
      pilot.track(route.room.line(robot.pose), moved);
      EXPECT_EQ(pilot.unknown_steps(), 0);
      // After half a metre it is on the route.
      if (steps > 2) {
        EXPECT_LT(std::abs(project_onto_route(route.path, robot.pose.position()).lateral_m), 0.05);
      }
    }
    EXPECT_FALSE(pilot.target().has_value());
    EXPECT_LT(distance(robot.pose.position(), route.pose_of(way.back()).position()), 0.1);
    EXPECT_GT(steps, 20);
  }
}

TEST(RoutePilot, BeginsOnlyWhereLineAndViewAgreeAndTheWayIsLong) {
  const RecordedRoute& route = recorded();
  RoutePilot pilot(route.known);
  const auto way = route.way(4, 15);
  const auto here = route.room.line(route.pose_of(way.front()));
  ASSERT_TRUE(pilot.begin_leg(way, here, shortest_m));
  EXPECT_FALSE(pilot.begin_leg(route.way(4, 6), here, shortest_m));
  EXPECT_FALSE(pilot.is_on_leg());
  EXPECT_TRUE(pilot.begin_leg(route.way(4, 7), here, shortest_m));
  // Another place of the route, another place, a way over other views, no way.
  EXPECT_FALSE(pilot.begin_leg(way, route.room.line(route.pose_of(route.views[12])), shortest_m));
  EXPECT_FALSE(pilot.begin_leg(way, pillared_room(777).line({0.3, 0.4, 1.0}), shortest_m));
  EXPECT_FALSE(pilot.begin_leg(std::vector<ViewId>{ViewId{900}, ViewId{901}}, here, shortest_m));
  EXPECT_FALSE(pilot.begin_leg({}, here, shortest_m));
  EXPECT_FALSE(RoutePilot().begin_leg(way, here, shortest_m));
  // An abandoned route is not begun again until all routes are allowed; one whose leg was ended is.
  ASSERT_TRUE(pilot.begin_leg(way, here, shortest_m));
  pilot.abandon_leg();
  EXPECT_FALSE(pilot.is_on_leg());
  EXPECT_FALSE(pilot.begin_leg(way, here, shortest_m));
  pilot.allow_all_routes();
  EXPECT_TRUE(pilot.begin_leg(way, here, shortest_m));
  pilot.end_leg();
  EXPECT_TRUE(pilot.begin_leg(way, here, shortest_m));
  EXPECT_THROW((void)pilot.begin_leg(way, std::vector<float>(7), shortest_m), ContractError);
  EXPECT_THROW(pilot.track(here, {}), ContractError);
}

TEST(RoutePilot, CountsStepsWithoutAPlaceOnTheLeg) {
  const RecordedRoute& route = recorded();
  RoutePilot pilot(route.known);
  const auto way = route.way(2, 9);
  const Pose2 start = route.pose_of(way.front());
  ASSERT_TRUE(pilot.begin_leg(way, route.room.line(start), shortest_m));
  // Lines of another room, lines of the route beyond the leg, no lines.
  const auto strange = pillared_room(777).line({0.3, 0.4, 1.0});
  const auto beyond = route.room.line(route.pose_of(route.views[17]));
  for (const auto& line : {strange, beyond, std::vector<float>{}}) {
    RoutePilot other = pilot;
    for (int step = 1; step <= 4; ++step) {
      other.track(line, {});
      EXPECT_EQ(other.unknown_steps(), step);
    }
  }
  // Odometry alone carries over some steps, and the next line agrees.
  Robot robot{start};
  for (int step = 0; step < 3; ++step) {
    ASSERT_TRUE(pilot.target().has_value());
    const Pose2 moved = robot.go(*pilot.target());
    pilot.track({}, moved);
  }
  pilot.track(route.room.line(robot.pose), {});
  EXPECT_EQ(pilot.unknown_steps(), 0);
  EXPECT_GT(project_onto_route(route.path, robot.pose.position()).along_m, 0.6 + 0.5);
}

}  // namespace
}  // namespace panonav::testing
