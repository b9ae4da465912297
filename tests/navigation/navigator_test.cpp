#include "panonav/navigation/navigator.hpp"
#include "support/text.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/statistics.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

constexpr double spacing_m = 0.3;
constexpr Point2 high{8.0, 4.0};

struct Drive {
  NavigationDecision end;
  double error_m = 0.0;
  double travelled_m = 0.0;
  std::vector<NavigationEvent> events;
  std::uint64_t bytes_read = 0;

  [[nodiscard]] bool had(NavigationEvent event) const {
    return std::ranges::find(events, event) != events.end();
  }
};

AreaPlanner phase_planner(const VisualMemory& memory, int views_per_area = 60) {
  Executor executor(1);
  return AreaPlanner(graph_from_links(MemoryViewSource(memory), memory.links(), executor),
                     {.areas = {.views_per_area = views_per_area}});
}

// Drives until the navigator stops. `kidnap_step`: then the robot is put down at `kidnap_to`.
Drive drive(const ToyWorld& world, const RememberedWorld& remembered, Navigator& navigator,
            ViewId goal, const Pose2& start, DriveKind kind, std::uint64_t seed, double light = 1.0,
            int kidnap_step = 0, const Pose2& kidnap_to = {}) {
  SimulatedRobot robot(world, start, kind, seed);
  Random noise(seed, 9);
  navigator.set_goal(goal);
  navigator.forget_place();
  Drive run;
  RobotReport report;
  for (int step = 1; step <= 600; ++step) {
    if (step == kidnap_step) robot.carry_to(kidnap_to);
    const auto decision =
        navigator.observe(two_rooms_signature(world, robot.pose(), noise, light), report);
    run.events.insert(run.events.end(), decision.events.begin(), decision.events.end());
    run.bytes_read += decision.bytes_read;
    run.end = decision;
    if (decision.state != NavigationState::moving) break;
    report.obstacle = robot.go(decision.direction_rad, decision.advance_m);
  }
  run.error_m = distance(robot.pose().position(), remembered.pose_of(goal).position());
  run.travelled_m = robot.travelled_m();
  return run;
}

Pose2 free_pose(const ToyWorld& world, Random& random, double low_x = 0.0, double high_x = 8.0) {
  for (;;) {
    const Pose2 pose{random.uniform(low_x, high_x), random.uniform(0.0, high.y_m),
                     random.uniform(-std::numbers::pi, std::numbers::pi)};
    if (world.clearance_m(pose.position()) > 0.25) return pose;
  }
}

TEST(Navigator, ArrivesFromAnywhereByPhasesAlone) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  int runs = 0;
  int arrived = 0;
  std::vector<double> ratios;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const ToyWorld world = two_rooms(seed, seed % 2 == 0);
    const RememberedWorld remembered(world, high, spacing_m, seed);
    const MemoryViewSource source(remembered.memory);
    Navigator navigator(source, phase_planner(remembered.memory));
    // What positions would say, for the shortest way.
    TopologicalMap map;
    for (const ViewId view : remembered.memory.views()) {
      map.nodes.push_back({view, remembered.pose_of(view), 0});
    }
    for (const Link& link : remembered.memory.links()) {
      map.edges.push_back({link.a, link.b, {}, link.kind, 1.0});
    }
    const NavigationGraph by_positions = graph_from_map(map);
    Random random(seed, 3);
    for (int i = 0; i < 15; ++i) {
      const ViewId goal = remembered.memory.views()[random.index(remembered.memory.size())];
      const Pose2 start = free_pose(world, random);
      const auto kind = i % 2 == 0 ? DriveKind::holonomic : DriveKind::differential;
      const Drive run = drive(world, remembered, navigator, goal, start, kind, random.next());
      ++runs;
      const bool right =
          run.end.state == NavigationState::arrived && run.error_m <= 0.5 * spacing_m;
      arrived += right;
      const auto guides = direction_field(by_positions, goal);
      const auto nearest = std::ranges::min_element(remembered.poses, {}, [&](const Pose2& p) {
        return distance(p.position(), start.position());
      });
      const double shortest =
          guides[static_cast<std::size_t>(nearest - remembered.poses.begin())].path_length;
      if (right && shortest > 1.0) ratios.push_back(run.travelled_m / shortest);
    }
  }
  RecordProperty("arrived", arrived);
  RecordProperty("median_length_over_shortest", std::to_string(upper_median(ratios)));
  EXPECT_GE(arrived, runs * 95 / 100);
  ASSERT_GT(ratios.size(), 20U);
  EXPECT_LT(upper_median(ratios), 1.3);
}

// Some drives in one world; how many ended right.
struct Outcome {
  int runs = 0;
  int arrived = 0;
};

constexpr double light_when_driving[] = {0.7, 1.3};

TEST(Navigator, ArrivesInOtherLight) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Outcome outcome;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const ToyWorld world = two_rooms(seed, true);
    const RememberedWorld remembered(world, high, spacing_m, seed);
    const MemoryViewSource source(remembered.memory);
    Navigator navigator(source, phase_planner(remembered.memory));
    Random random(seed, 4);
    for (int i = 0; i < 8; ++i) {
      const ViewId goal = remembered.memory.views()[random.index(remembered.memory.size())];
      const Drive run = drive(world, remembered, navigator, goal, free_pose(world, random),
                              DriveKind::differential, random.next(), light_when_driving[i % 2]);
      ++outcome.runs;
      outcome.arrived +=
          run.end.state == NavigationState::arrived && run.error_m <= 0.5 * spacing_m;
    }
  }
  EXPECT_GE(outcome.arrived, outcome.runs * 9 / 10);
}

TEST(Navigator, FewComponentsInTheOpenAreEnoughAndCostLess) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Outcome coarse;
  Outcome full;
  struct Work {
    std::uint64_t bytes = 0;
    int steps = 0;
    [[nodiscard]] double bytes_per_step() const { return static_cast<double>(bytes) / steps; }
  };
  Work coarse_work;
  Work full_work;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const ToyWorld world = two_rooms(seed, true);
    const RememberedWorld remembered(world, high, spacing_m, seed);
    const MemoryViewSource source(remembered.memory);
    for (const bool all : {true, false}) {
      NavigatorOptions options;
      if (all) options.coarse_components = 0;
      Navigator navigator(source, phase_planner(remembered.memory), options);
      Outcome& outcome = all ? full : coarse;
      Random random(seed, 8);
      for (int i = 0; i < 10; ++i) {
        const ViewId goal = remembered.memory.views()[random.index(remembered.memory.size())];
        const Drive run = drive(world, remembered, navigator, goal, free_pose(world, random),
                                DriveKind::differential, random.next());
        ++outcome.runs;
        outcome.arrived +=
            run.end.state == NavigationState::arrived && run.error_m <= 0.5 * spacing_m;
        Work& work = all ? full_work : coarse_work;
        work.bytes += run.bytes_read;
        work.steps += run.end.step;
      }
    }
  }
  EXPECT_GE(full.arrived, full.runs * 95 / 100);
  EXPECT_GE(coarse.arrived, coarse.runs * 95 / 100);
  // These rooms are small: most places lie near the doors or the goal.
  EXPECT_LT(coarse_work.bytes_per_step(), 0.9 * full_work.bytes_per_step());
}

// All components at the goal, in a narrow place and where the robot does not know where it is.
TEST(Navigator, ComparesAllComponentsWhereItMatters) {
  const ToyWorld world = two_rooms(1, false);
  const RememberedWorld remembered(world, high, spacing_m, 1);
  const MemoryViewSource source(remembered.memory);
  AreaPlanner planner = phase_planner(remembered.memory);
  const auto narrow = find_narrow_places(planner.graph(), planner.areas(), 2);
  ASSERT_NE(std::ranges::count(narrow, std::uint8_t{1}), 0);
  Navigator navigator(source, std::move(planner));
  const NavigationGraph& graph = navigator.planner().graph();
  Random noise(5);
  // The robot drives from one room into the other, held on the way that is planned.
  const std::size_t goal = graph.size() - 1;
  navigator.set_goal(graph.view(goal));
  AreaPlanner planning = navigator.planner();
  const auto way = planning.plan_path(0);
  ASSERT_GT(way.size(), 10U);
  const auto around_goal = nodes_around(graph, {&goal, 1}, 2);
  int coarse = 0;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const Pose2& pose = remembered.pose_of(graph.view(way[i]));
    const auto decision = navigator.observe(two_rooms_signature(world, pose, noise));
    ASSERT_EQ(decision.nearest, graph.view(way[i]));
    EXPECT_GT(decision.bytes_read, 0U);
    // What counts is the place where the robot was before it looked.
    const bool all =
        i == 0 || narrow[way[i - 1]] != 0 || std::ranges::binary_search(around_goal, way[i - 1]);
    EXPECT_EQ(decision.components, all ? 15 : 6) << "at place " << i << " of the way";
    coarse += decision.components == 6;
  }
  EXPECT_GT(coarse, 2);
}

TEST(Navigator, AKidnappedRobotStillArrives) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Outcome outcome;
  int noticed = 0;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const ToyWorld world = two_rooms(seed, true);
    const RememberedWorld remembered(world, high, spacing_m, seed);
    const MemoryViewSource source(remembered.memory);
    Navigator navigator(source, phase_planner(remembered.memory));
    Random random(seed, 5);
    for (int i = 0; i < 8; ++i) {
      // From one room into the other, and carried on the way from one into the other.
      const bool leftwards = i % 2 == 0;
      ViewId goal;
      do {
        goal = remembered.memory.views()[random.index(remembered.memory.size())];
      } while ((remembered.pose_of(goal).x_m < 4.0) != leftwards);
      const Pose2 start = free_pose(world, random, leftwards ? 5.0 : 0.0, leftwards ? 8.0 : 3.0);
      const Pose2 carried = free_pose(world, random, leftwards ? 5.0 : 0.0, leftwards ? 8.0 : 3.0);
      const Drive run = drive(world, remembered, navigator, goal, start, DriveKind::holonomic,
                              random.next(), 1.0, 8, carried);
      ++outcome.runs;
      noticed += run.had(NavigationEvent::kidnapped);
      outcome.arrived +=
          run.end.state == NavigationState::arrived && run.error_m <= 0.5 * spacing_m;
    }
  }
  EXPECT_GE(outcome.arrived, outcome.runs * 9 / 10);
  // Not by who was carried a few edges only: the search around finds such a place.
  EXPECT_GE(noticed, outcome.runs / 3);
}

// The door, or one of two, is shut after the memory was made.
TEST(Navigator, AShutDoorIsGoneRoundOrMakesTheGoalUnreachable) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Outcome with_detour;
  Outcome without;
  int told = 0;
  int steps = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    for (const bool second_door : {true, false}) {
      ToyWorld world = two_rooms(seed, second_door);
      const RememberedWorld remembered(world, high, spacing_m, seed);
      world.add_wall({4, 2.4}, {4, 3.2}, Texture(world.random(), 0.15), 0.8);
      const MemoryViewSource source(remembered.memory);
      Navigator navigator(source, phase_planner(remembered.memory));
      Random random(seed, 6);
      for (int i = 0; i < 4; ++i) {
        ViewId goal;
        do {
          goal = remembered.memory.views()[random.index(remembered.memory.size())];
        } while (remembered.pose_of(goal).x_m < 5.0);
        const Drive run =
            drive(world, remembered, navigator, goal, free_pose(world, random, 0.0, 3.0),
                  DriveKind::holonomic, random.next());
        const bool arrived =
            run.end.state == NavigationState::arrived && run.error_m <= 0.5 * spacing_m;
        Outcome& outcome = second_door ? with_detour : without;
        ++outcome.runs;
        outcome.arrived += arrived;
        if (!second_door) {
          told += run.end.state == NavigationState::unreachable;
          steps += run.end.step;
          EXPECT_TRUE(run.had(NavigationEvent::closed));
        }
      }
    }
  }
  EXPECT_GE(with_detour.arrived, with_detour.runs * 9 / 10);
  EXPECT_EQ(without.arrived, 0);
  EXPECT_GE(told, without.runs * 9 / 10);
  // Three attempts, each of some closings with `edge_patience` steps.
  EXPECT_LE(steps, without.runs * 300);
}

TEST(Navigator, IsLostInAnotherPlace) {
  const ToyWorld world = two_rooms(1, false);
  const RememberedWorld remembered(world, high, spacing_m, 1);
  const ToyWorld elsewhere = two_rooms(2, false);
  const MemoryViewSource source(remembered.memory);
  Navigator navigator(source, phase_planner(remembered.memory));
  Random random(3);
  for (int i = 0; i < 3; ++i) {
    const ViewId goal = remembered.memory.views()[random.index(remembered.memory.size())];
    const Drive run = drive(elsewhere, remembered, navigator, goal, free_pose(elsewhere, random),
                            DriveKind::holonomic, random.next());
    EXPECT_EQ(run.end.state, NavigationState::lost) << describe(run.end);
    EXPECT_TRUE(run.had(NavigationEvent::relocalised));
  }
}

// The limit of the difference alone lets foreign views through; the robot drove on for 30 steps.
TEST(Navigator, SaysHowProbableItsPlaceIsAndStopsWhereNoneIs) {
  const ToyWorld world = two_rooms(1, true);
  const RememberedWorld remembered(world, high, spacing_m, 1);
  const MemoryViewSource source(remembered.memory);
  const NavigatorOptions options;
  Navigator navigator(source, phase_planner(remembered.memory), options);
  int sure = 0;
  int right = 0;
  Random random(4);
  for (int i = 0; i < 100; ++i) {
    navigator.set_goal(remembered.memory.views()[random.index(remembered.memory.size())]);
    navigator.forget_place();
    const Pose2 pose = free_pose(world, random);
    const auto decision = navigator.observe(two_rooms_signature(world, pose, random));
    if (decision.probability < 0.9) continue;
    ++sure;
    right += distance(remembered.pose_of(*decision.nearest).position(), pose.position()) <=
             1.5 * spacing_m;
  }
  EXPECT_GE(sure, 80);
  EXPECT_GE(right, sure * 9 / 10);

  const auto stops = [&](const auto& view) {
    navigator.set_goal(remembered.memory.views().front());
    navigator.forget_place();
    NavigationDecision decision;
    do {
      decision = navigator.observe(view());
      EXPECT_LT(decision.probability, 0.5) << describe(decision);
    } while (decision.state == NavigationState::moving);
    EXPECT_EQ(decision.state, NavigationState::lost) << describe(decision);
    EXPECT_LE(decision.step, 2 * options.lost_patience);
  };
  for (std::uint64_t seed = 2; seed <= 4; ++seed) {
    const ToyWorld elsewhere = two_rooms(seed, true);
    stops([&] { return two_rooms_signature(elsewhere, free_pose(elsewhere, random), random); });
  }
  stops([&] {
    Panorama noise(12, 64, ElevationBand{radians(-25.0), radians(35.0)});
    for (float& value : noise.values()) value = static_cast<float>(random.uniform());
    return compute_signature(preprocess(noise, {}));
  });
}

// What stands in the way stands in the picture, too, and makes the robot's own place improbable.
TEST(Navigator, IsNotLostBehindAScreen) {
  ToyWorld world = two_rooms(1, false);
  const RememberedWorld remembered(world, high, spacing_m, 1);
  world.add_wall({3.55, 2.1}, {3.55, 3.5}, Texture(world.random(), 0.15), 0.8);
  const MemoryViewSource source(remembered.memory);
  const NavigatorOptions options;
  Navigator navigator(source, phase_planner(remembered.memory), options);
  ViewId goal = remembered.memory.views().front();
  for (const ViewId view : remembered.memory.views()) {
    if (remembered.pose_of(view).x_m > 6.0) goal = view;
  }
  navigator.set_goal(goal);
  Random random(1);
  int improbable = 0;
  NavigationDecision decision;
  do {
    const Pose2 pose{random.uniform(3.3, 3.35), random.uniform(2.7, 2.9), 0.0};
    decision = navigator.observe(two_rooms_signature(world, pose, random), {.obstacle = true});
    improbable += decision.probability < 0.5;
  } while (decision.state == NavigationState::moving);
  EXPECT_GT(improbable, options.lost_patience);
  EXPECT_EQ(decision.state, NavigationState::unreachable) << describe(decision);
}

TEST(Navigator, GoesNowhereWithoutAWay) {
  const ToyWorld world = two_rooms(1, false);
  RememberedWorld remembered(world, high, spacing_m, 1);
  const ViewId goal = remembered.memory.views().front();
  for (const ViewId neighbour : remembered.memory.neighbours(goal)) {
    remembered.memory.unlink(goal, neighbour);
  }
  const MemoryViewSource source(remembered.memory);
  Navigator navigator(source, phase_planner(remembered.memory));
  Random random(3);
  const Drive run =
      drive(world, remembered, navigator, goal, {6.8, 3.4, 0.0}, DriveKind::holonomic, 1);
  EXPECT_EQ(run.end.state, NavigationState::unreachable);
  EXPECT_EQ(run.end.step, 1);
  EXPECT_EQ(run.end.advance_m, 0.0);
}

// A step leads beyond the references that lie two edges away, and past the goal.
TEST(Navigator, ArrivesOverReferencesThatStandCloseTogether) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  constexpr double close_m = 0.1;
  const ToyWorld world = two_rooms(3, false);
  const RememberedWorld remembered(world, {3.0, 2.0}, close_m, 3);
  const MemoryViewSource source(remembered.memory);
  Navigator navigator(source, phase_planner(remembered.memory, 200));
  Random random(7);
  constexpr int runs = 10;
  int arrived = 0;
  std::vector<double> ratios;
  for (int i = 0; i < runs; ++i) {
    const ViewId goal = remembered.memory.views()[random.index(remembered.memory.size())];
    Pose2 start;
    do {
      start = {random.uniform(0.3, 2.7), random.uniform(0.3, 1.7),
               random.uniform(-std::numbers::pi, std::numbers::pi)};
    } while (world.clearance_m(start.position()) < 0.25);
    const Drive run =
        drive(world, remembered, navigator, goal, start, DriveKind::holonomic, random.next());
    arrived +=
        static_cast<int>(run.end.state == NavigationState::arrived && run.error_m <= 0.5 * close_m);
    const double straight_m = distance(start.position(), remembered.pose_of(goal).position());
    if (straight_m > 0.5) ratios.push_back(run.travelled_m / straight_m);
  }
  EXPECT_GE(arrived, runs - 1);
  ASSERT_GE(ratios.size(), 5U);
  EXPECT_LT(upper_median(ratios), 2.0);
}

// The memory lacks the edges of some views: a robot that stands at one goes on by another.
TEST(Navigator, GoesOnFromAPlaceWithoutAWay) {
  const ToyWorld world = two_rooms(1, false);
  RememberedWorld remembered(world, high, spacing_m, 1);
  Random random(5);
  const ViewId goal = remembered.memory.views().back();
  constexpr int trials = 6;
  std::vector<ViewId> apart;
  while (apart.size() < trials) {
    const ViewId view = remembered.memory.views()[random.index(remembered.memory.size())];
    if (view == goal || std::ranges::find(apart, view) != apart.end()) continue;
    apart.push_back(view);
    for (const ViewId neighbour : remembered.memory.neighbours(view)) {
      remembered.memory.unlink(view, neighbour);
    }
  }
  const MemoryViewSource source(remembered.memory);
  Navigator navigator(source, phase_planner(remembered.memory));
  int arrived = 0;
  for (const ViewId view : apart) {
    const Drive run = drive(world, remembered, navigator, goal, remembered.pose_of(view),
                            DriveKind::holonomic, random.next());
    arrived += static_cast<int>(run.end.state == NavigationState::arrived &&
                                run.error_m <= 0.5 * spacing_m);
  }
  EXPECT_GE(arrived, trials - 1);
}

TEST(Navigator, SameCallsGiveTheSameDecisions) {
  const ToyWorld world = two_rooms(2, true);
  const RememberedWorld remembered(world, high, spacing_m, 2);
  const MemoryViewSource source(remembered.memory);
  std::vector<std::string> logs[2];
  for (auto& log : logs) {
    Navigator navigator(source, phase_planner(remembered.memory));
    navigator.set_goal(remembered.memory.views().back());
    SimulatedRobot robot(world, {1.0, 1.0, 0.3}, DriveKind::differential, 4);
    Random noise(5);
    RobotReport report;
    for (int step = 0; step < 30; ++step) {
      const auto decision =
          navigator.observe(two_rooms_signature(world, robot.pose(), noise), report);
      log.push_back(describe(decision));
      report.obstacle = robot.go(decision.direction_rad, decision.advance_m);
    }
  }
  EXPECT_EQ(logs[0], logs[1]);
  EXPECT_TRUE(contains(logs[0].front(), "relocalised"));
}

TEST(Navigator, TakesThePlaceOfAnotherEstimate) {
  const ToyWorld world = two_rooms(2, true);
  const RememberedWorld remembered(world, high, spacing_m, 2);
  const MemoryViewSource source(remembered.memory);
  Navigator navigator(source, phase_planner(remembered.memory));
  navigator.set_goal(remembered.memory.views().back());
  Random noise(5);
  const ViewId here = remembered.memory.views()[20];
  const auto decision = navigator.observe(
      two_rooms_signature(world, remembered.pose_of(here), noise), {.estimate = here});
  EXPECT_EQ(decision.nearest, here);
  EXPECT_TRUE(std::ranges::find(decision.events, NavigationEvent::relocalised) ==
              decision.events.end());
}

// What the way to another goal was says nothing of how far a step leads, which tells a robot when
// it is near enough to its goal for homing.
TEST(Navigator, ForgetsTheWayToTheGoalBefore) {
  const ToyWorld world = two_rooms(2, true);
  const RememberedWorld remembered(world, high, spacing_m, 2);
  const MemoryViewSource source(remembered.memory);
  const AreaPlanner planner = phase_planner(remembered.memory);
  const NavigationGraph& graph = planner.graph();
  const std::size_t here = 20;
  const auto beside = nodes_around(graph, {&here, 1}, 1);
  const auto around = nodes_around(graph, {&here, 1}, 2);
  const auto two_edges_away = std::ranges::find_if(
      around, [&](std::size_t node) { return !std::ranges::binary_search(beside, node); });
  ASSERT_NE(two_edges_away, around.end());
  const ViewId goal = graph.view(*two_edges_away);
  Random noise(5);
  const FourierSignature seen = two_rooms_signature(world, remembered.poses[here], noise);
  const RobotReport report{.estimate = graph.view(here)};
  Navigator fresh(source, planner);
  fresh.set_goal(goal);
  Navigator changed(source, planner);
  changed.set_goal(graph.views().back());
  (void)changed.observe(seen, report);
  changed.set_goal(goal);
  const auto expected = fresh.observe(seen, report);
  const auto decision = changed.observe(seen, report);
  ASSERT_FALSE(expected.homing);
  EXPECT_FALSE(decision.homing);
  EXPECT_EQ(decision.next, expected.next);
  EXPECT_EQ(decision.direction_rad, expected.direction_rad);
}

TEST(Navigator, RefusesWhatItCannotDo) {
  const ToyWorld world = two_rooms(1, false);
  const RememberedWorld remembered(world, high, 0.8, 1);
  const MemoryViewSource source(remembered.memory);
  Navigator navigator(source, phase_planner(remembered.memory));
  Random noise(1);
  EXPECT_THROW((void)navigator.observe(two_rooms_signature(world, {1, 1, 0}, noise)),
               ContractError);
  EXPECT_THROW(navigator.set_goal(ViewId{99999}), ContractError);
  EXPECT_THROW(Navigator(source, phase_planner(remembered.memory), {.step_m = 0.0}), OptionError);
  EXPECT_THROW(Navigator(source, phase_planner(remembered.memory), {.min_leg_m = 0.0}),
               OptionError);
  EXPECT_THROW(Navigator(source, phase_planner(remembered.memory), {.coarse_components = 2}),
               ContractError);
  EXPECT_THROW(Navigator(source, AreaPlanner(NavigationGraph({}, {}))), ContractError);
}

}  // namespace
}  // namespace panonav::testing
