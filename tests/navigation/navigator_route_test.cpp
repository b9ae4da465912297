// A navigator with a recorded route.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/navigation/navigator.hpp"
#include "panonav/route/route_position.hpp"
#include "support/remembered_worlds.hpp"
#include "support/smooth_path.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

constexpr double grid_spacing_m = 0.4;
constexpr double max_lateral_m = 0.4;

// Two rooms, a grid of views in them, and a route from one into the other.
struct World {
  ToyWorld walls = two_rooms(1, false);
  RememberedWorld remembered{walls, {8.0, 4.0}, grid_spacing_m, 1};
  MemoryViewSource source{remembered.memory};
  std::vector<Pose2> path = smooth_path(
      std::vector<Point2>{{0.8, 0.8}, {2.6, 1.0}, {3.4, 2.6}, {4.6, 2.8}, {5.4, 1.9}, {7.2, 1.2}},
      0.1);
  std::vector<KnownRoute> routes;

  World() {
    RoutePanorama route;
    for (const Pose2& pose : path) route.append(pose, two_rooms_line(walls, pose));
    std::vector<KnownRoute::View> views;
    for (const ViewId view : remembered.memory.views()) {
      views.push_back({view, remembered.pose_of(view)});
    }
    routes.push_back(make_known_route(
        route, views, {.max_lateral_m = max_lateral_m, .tracker = {.min_correlation = 0.7}}));
  }
  [[nodiscard]] Navigator navigator() const {
    Executor executor(1);
    return {source, AreaPlanner(graph_from_links(source, remembered.memory.links(), executor))};
  }
  [[nodiscard]] ViewId view_at(Point2 place) const {
    const auto& poses = remembered.poses;
    const auto nearest = std::ranges::min_element(
        poses, {}, [&](const Pose2& pose) { return distance(pose.position(), place); });
    return remembered.memory.views()[static_cast<std::size_t>(nearest - poses.begin())];
  }
  [[nodiscard]] double off_m(Point2 place) const {
    return std::abs(project_onto_route(path, place).lateral_m);
  }
};

const World& world() {
  static const World made;
  return made;
}

struct Drive {
  std::vector<NavigationDecision> decisions;
  std::vector<Pose2> path;  // true poses at the steps

  [[nodiscard]] std::optional<std::size_t> look_of(NavigationDecision::Event event) const {
    for (std::size_t i = 0; i < decisions.size(); ++i) {
      const auto& events = decisions[i].events;
      if (std::ranges::find(events, event) != events.end()) return i;
    }
    return std::nullopt;
  }
  [[nodiscard]] std::size_t on_route() const {
    return static_cast<std::size_t>(
        std::ranges::count(decisions, true, &NavigationDecision::on_route));
  }
};

struct DriveOptions {
  bool lines = true;
  std::optional<Pose2> kidnapped_to;  // at the sixth step of a leg
};

Drive drive(Navigator& navigator, ViewId goal, const Pose2& start, std::uint64_t seed,
            const DriveOptions& options) {
  SimulatedRobot robot(world().walls, start, DriveKind::differential, seed);
  Random noise(seed, 9);
  navigator.set_goal(goal);
  navigator.forget_place();
  Drive run;
  bool obstacle = false;
  for (int step = 1; step <= 400; ++step) {
    RobotReport report{.obstacle = obstacle, .moved = robot.take_odometry()};
    std::vector<float> line;
    if (options.lines) line = two_rooms_line(world().walls, robot.pose());
    report.line = line;
    run.path.push_back(robot.pose());
    run.decisions.push_back(
        navigator.observe(two_rooms_signature(world().walls, robot.pose(), noise), report));
    const NavigationDecision& decision = run.decisions.back();
    if (decision.state != NavigationDecision::State::moving) break;
    obstacle = robot.go(decision.direction_rad, decision.advance_m);
    if (options.kidnapped_to && run.on_route() == 6) {
      robot.teleport_to(*options.kidnapped_to);
    }
  }
  return run;
}

TEST(NavigatorOnARoute, RepeatsItTowardsGoalsAtBothEndsAndArrives) {
  ASSERT_TRUE(std::ranges::all_of(
      world().path, [](const Pose2& pose) { return robot_fits(world().walls, pose.position()); }));
  Navigator navigator = world().navigator();
  navigator.set_routes(world().routes);
  for (const bool back : {false, true}) {
    const Point2 low = world().path.front().position();
    const Point2 high = world().path.back().position();
    const ViewId goal = world().view_at(back ? low : high);
    const Pose2 start{back ? high.x_m : low.x_m, back ? high.y_m : low.y_m, 2.0};
    const Drive run = drive(navigator, goal, start, 3, {});
    EXPECT_EQ(run.decisions.back().state, NavigationDecision::State::arrived);
    EXPECT_LE(distance(run.path.back().position(), world().remembered.pose_of(goal).position()),
              0.5 * grid_spacing_m);
    EXPECT_TRUE(run.look_of(NavigationDecision::Event::route).has_value());
    EXPECT_FALSE(run.look_of(NavigationDecision::Event::route_left).has_value());
    EXPECT_GT(2 * run.on_route(), run.decisions.size());
    int steps = 0;
    for (std::size_t i = 0; i < run.path.size(); ++i) {
      const NavigationDecision& decision = run.decisions[i];
      steps = decision.on_route ? steps + 1 : 0;
      EXPECT_LE(decision.advance_m, 0.25);
      if (!decision.on_route) continue;
      EXPECT_FALSE(decision.homing);
      EXPECT_TRUE(contains(describe(decision), "along a route"));
      // After half a metre it is on the path that was driven.
      const double off_m = world().off_m(run.path[i].position());
      EXPECT_LT(off_m, steps > 3 ? 0.1 : max_lateral_m) << "step " << i + 1;
    }
  }
}

TEST(NavigatorOnARoute, WithoutLinesDecidesAsWithoutARoute) {
  const ViewId goal = world().view_at(world().path.back().position());
  const Pose2 start = world().path.front();
  std::vector<Drive> runs;
  for (const bool lines : {true, false}) {
    Navigator navigator = world().navigator();
    if (!lines) navigator.set_routes(world().routes);
    runs.push_back(drive(navigator, goal, start, 4, {.lines = lines}));
  }
  ASSERT_GT(runs[0].decisions.size(), 20U);
  EXPECT_EQ(runs[1].path, runs[0].path);
  ASSERT_EQ(runs[1].decisions.size(), runs[0].decisions.size());
  for (std::size_t i = 0; i < runs[0].decisions.size(); ++i) {
    EXPECT_EQ(describe(runs[1].decisions[i]), describe(runs[0].decisions[i]));
  }
}

TEST(NavigatorOnARoute, ARobotThatIsCarriedAwayLeavesItAndArrives) {
  Navigator navigator = world().navigator();
  navigator.set_routes(world().routes);
  const ViewId goal = world().view_at(world().path.back().position());
  const Pose2 carried{1.0, 3.4, 0.5};
  ASSERT_GT(world().off_m(carried.position()), 2.0 * max_lateral_m);
  const Drive run = drive(navigator, goal, world().path.front(), 5, {.kidnapped_to = carried});
  const auto left = run.look_of(NavigationDecision::Event::route_left);
  ASSERT_TRUE(left.has_value());
  // Within the steps that must agree, and one for a place that surprises.
  const auto sixth = *run.look_of(NavigationDecision::Event::route) + 5;
  EXPECT_LE(*left, sixth + 4);
  EXPECT_FALSE(run.decisions[*left].on_route);
  EXPECT_EQ(run.decisions.back().state, NavigationDecision::State::arrived);
}

// The door is shut after route and views were made.
TEST(NavigatorOnARoute, AShutDoorEndsTheLegAndTheRouteIsNotTriedAgain) {
  ToyWorld walls = two_rooms(1, false);
  walls.add_wall({4, 2.4}, {4, 3.2}, Texture(walls.random(), 0.15), 0.8);
  Navigator navigator = world().navigator();
  navigator.set_routes(world().routes);
  const ViewId goal = world().view_at(world().path.back().position());
  SimulatedRobot robot(walls, world().path.front(), DriveKind::holonomic, 6);
  Random noise(6, 9);
  navigator.set_goal(goal);
  bool obstacle = false;
  int left = 0;
  int begun_after = 0;
  NavigationDecision decision;
  int since_left = 0;
  constexpr int enough_steps = 40;
  while (since_left < enough_steps) {
    RobotReport report{.obstacle = obstacle, .moved = robot.take_odometry()};
    const auto line = two_rooms_line(walls, robot.pose());
    report.line = line;
    decision = navigator.observe(two_rooms_signature(walls, robot.pose(), noise), report);
    for (const NavigationDecision::Event event : decision.events) {
      begun_after += static_cast<int>(left > 0 && event == NavigationDecision::Event::route);
      left += static_cast<int>(event == NavigationDecision::Event::route_left);
    }
    since_left += left;
    ASSERT_LT(decision.step, 200);
    ASSERT_NE(decision.state, NavigationDecision::State::arrived);
    if (decision.state != NavigationDecision::State::moving) break;
    obstacle = robot.go(decision.direction_rad, decision.advance_m);
  }
  EXPECT_EQ(left, 1);
  EXPECT_EQ(begun_after, 0);
}

}  // namespace
}  // namespace panonav::testing
