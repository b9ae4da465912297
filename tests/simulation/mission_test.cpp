#include "panonav_simulation/mission.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav_simulation/scenes.hpp"
#include "support/scene_views.hpp"
#include "support/skips.hpp"

namespace panonav::simulation {
namespace {

TEST(MissionRobot, StopsWhereSomethingIsInItsWayAndFeelsItsWayPast) {
  Executor executor(2);
  const MissionPlace place = make_mission_place(make_scene("loop", {.seed = 3}), executor);
  const OdometryNoise exact = testing::exact_odometry();
  const Point2 start = place.scene.tour.front();
  const BaseOptions base;
  // Straight on until it touches something, in every direction.
  for (int k = 0; k < 8; ++k) {
    MissionRobot robot(place, base, exact,
                       {start.x_m, start.y_m, -std::numbers::pi + k * std::numbers::pi / 4.0}, 1);
    bool stopped = false;
    for (int step = 0; step < 2000 && !stopped; ++step) {
      robot.command({.forward_m_s = base.speed_m_s});
      stopped = robot.take_contact();
      ASSERT_GE(place.free_space->clearance_m(robot.pose().position()), place.scene.robot_radius_m);
    }
    EXPECT_TRUE(stopped) << k;
    EXPECT_FALSE(robot.take_contact());
    // Ahead is no way; where there is one it is at most 90 degrees aside.
    const auto aside = robot.find_free_direction(0.0, 0.3);
    if (!aside) continue;
    EXPECT_NE(*aside, 0.0);
    EXPECT_LE(std::abs(*aside), std::numbers::pi / 2.0 + 1e-9);
  }
}

const MissionPlace& office() {
  Executor executor(2);
  static const MissionPlace place =
      make_mission_place(make_scene("office", {.seed = 71}), executor);
  return place;
}

TEST(RememberedGrid, RoomsAndCorridorsAreArrangedWithoutFolding) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor two(2);
  const MissionPlace place = make_mission_place(make_scene("loop", {.seed = 2}), two);
  const RememberedPlace remembered = memorise_grid(place, 0.3, 5, two);
  const Lattice lattice = arrange(remembered.memory, {}, {}, two);
  std::vector<Point2> found;
  std::vector<Point2> truth;
  for (std::size_t i = 0; i < lattice.nodes.size(); ++i) {
    if (lattice.nodes[i].component != 0) continue;
    found.push_back(lattice.nodes[i].pose.position());
    truth.push_back(remembered.truth[i].position());
  }
  EXPECT_GE(found.size(), 4 * lattice.nodes.size() / 10);
  EXPECT_LT(shape_difference(found, truth).value, 0.05);
}

TEST(Missions, ArriveOverAMemoryWithoutPositionsAndAreRepeatable) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor two(2);
  const MissionPlace& place = office();
  const RememberedPlace remembered = memorise_grid(place, 0.4, 5, two);
  ASSERT_GT(remembered.truth.size(), 40U);
  ASSERT_EQ(remembered.graph.size(), remembered.truth.size());
  const auto missions = sample_missions(place, remembered, {.count = 8}, 3);
  const auto runs = run_missions(place, remembered, missions, {}, 9, two);
  int arrived = 0;
  for (const MissionRun& run : runs) {
    ASSERT_FALSE(run.path.empty());
    ASSERT_EQ(run.path.size(), run.decisions.size());
    EXPECT_NE(run.end, NavigationDecision::State::moving);
    EXPECT_GE(run.shortest_m, 0.0);
    arrived += static_cast<int>(run.has_arrived(0.2));
    // No robot ever stands in a thing.
    for (const Pose2& pose : run.path) {
      EXPECT_GE(place.free_space->clearance_m(pose.position()), place.scene.robot_radius_m);
    }
  }
  EXPECT_GE(arrived, 7);
  Executor one(1);
  const auto again = run_missions(place, remembered, missions, {}, 9, one);
  for (std::size_t i = 0; i < runs.size(); ++i) EXPECT_EQ(again[i].path, runs[i].path);
}

TEST(Missions, ARobotThatIsCarriedAwayFindsItsGoalAllTheSame) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor executor(2);
  const MissionPlace place = make_mission_place(make_scene("office", {.seed = 72}), executor);
  const RememberedPlace remembered = memorise_grid(place, 0.4, 5, executor);
  const auto missions = sample_missions(place, remembered, {.count = 8, .kidnapped = true}, 4);
  const auto runs = run_missions(place, remembered, missions, {}, 10, executor);
  int carried = 0;
  int arrived = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].kidnapped_at) continue;
    ++carried;
    const std::size_t next = *runs[i].kidnapped_at + 1;
    ASSERT_LT(next, runs[i].path.size());
    EXPECT_EQ(runs[i].path[next], *missions[i].kidnapped_to);
    arrived += static_cast<int>(runs[i].has_arrived(0.2));
  }
  ASSERT_GE(carried, 4);
  EXPECT_GE(arrived, carried - 1);
}

TEST(Missions, ATourGoesOnFromGoalToGoalAmongPeople) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor executor(2);
  const MissionPlace place = make_mission_place(make_scene("loop", {.seed = 73}), executor);
  std::vector<Pose2> way;
  const auto& tour = place.scene.tour;
  for (std::size_t i = 0; i < tour.size(); ++i) {
    const Point2 from = tour[i];
    const Point2 to = tour[(i + 1) % tour.size()];
    const int steps = static_cast<int>(std::ceil(distance(from, to) / 0.25));
    for (int k = 0; k < steps; ++k) {
      const double share = static_cast<double>(k) / steps;
      way.push_back({from.x_m + share * (to.x_m - from.x_m), from.y_m + share * (to.y_m - from.y_m),
                     std::atan2(to.y_m - from.y_m, to.x_m - from.x_m)});
    }
  }
  const RememberedPlace remembered = memorise_drive(place, way, {}, 5, executor);
  // Without a camera for lines there is no route.
  EXPECT_TRUE(remembered.routes.empty());
  // Monte-Carlo localisation asks for poses.
  ASSERT_TRUE(remembered.memory.info(remembered.graph.view(0)).pose.has_value());
  const MemoryViewSource source(remembered.memory);
  for (const bool monte_carlo : {false, true}) {
    Navigator navigator(source, AreaPlanner(remembered.graph));
    const std::vector<ViewId> goals{remembered.graph.view(20), remembered.graph.view(40),
                                    remembered.graph.view(5)};
    MissionOptions options;
    options.people = monte_carlo ? 0 : 2;
    options.monte_carlo = monte_carlo;
    const auto runs = run_tour(place, remembered, navigator, way[0], goals, options, 4);
    ASSERT_EQ(runs.size(), goals.size());
    int arrived = 0;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      if (i > 0) {
        EXPECT_EQ(runs[i].path.front(), runs[i - 1].path.back());
      }
      EXPECT_GT(runs[i].shortest_m, 0.5);
      arrived += static_cast<int>(runs[i].has_arrived(0.15));
    }
    EXPECT_GE(arrived, 2) << monte_carlo;
  }
}

TEST(Missions, ADriveWithLinesRecordsARouteThatIsRepeated) {
  Executor executor(2);
  MissionPlace place = make_mission_place(make_scene("loop", {.seed = 74}), executor);
  const Point2 from = place.scene.tour[0];
  const Point2 to = place.scene.tour[1];
  std::vector<Pose2> way;
  for (double along_m = 0.0; along_m < 3.0; along_m += 0.25) {
    const double share = along_m / distance(from, to);
    way.push_back({from.x_m + share * (to.x_m - from.x_m), from.y_m + share * (to.y_m - from.y_m),
                   std::atan2(to.y_m - from.y_m, to.x_m - from.x_m)});
  }
  place.line = make_line_sensor(place);
  const RememberedPlace remembered = memorise_drive(place, way, {}, 5, executor);
  ASSERT_EQ(remembered.routes.size(), 1U);
  const KnownRoute& route = remembered.routes.front();
  // Each view lies on the route where the drive had come to then.
  ASSERT_EQ(route.references.size(), way.size());
  double along_m = 0.0;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const auto& here = remembered.memory.info(remembered.graph.view(i)).pose;
    ASSERT_TRUE(here.has_value());
    if (i > 0) {
      const auto& before = remembered.memory.info(remembered.graph.view(i - 1)).pose;
      along_m += distance(before->position(), here->position());
    }
    EXPECT_NEAR(route.along_m(remembered.graph.view(i)).front(), along_m, 1e-6);
  }
  const Mission mission{remembered.graph.view(way.size() - 1), way.front(), {}};
  const auto run = run_missions(place, remembered, {mission}, {}, 3, executor).front();
  EXPECT_TRUE(run.has_arrived(0.125));
  const auto on_route = std::ranges::count(run.decisions, true, &NavigationDecision::on_route);
  EXPECT_GT(2 * static_cast<std::size_t>(on_route), run.decisions.size());
}

TEST(Missions, RefuseWhatMakesNoSense) {
  Executor executor(2);
  const MissionPlace& place = office();
  const RememberedPlace remembered = memorise_grid(place, 1.0, 5, executor);
  EXPECT_THROW((void)sample_missions(place, remembered, {.count = -1}, 1), ContractError);
  EXPECT_THROW((void)sample_missions(place, remembered, {.max_distance_m = 0.0}, 1), ContractError);
  const MemoryViewSource source(remembered.memory);
  Navigator navigator(source, AreaPlanner(remembered.graph));
  EXPECT_THROW((void)run_mission(place, remembered, navigator, {ViewId{9999}, {}, {}}, {}, 1),
               ContractError);
}

TEST(Mission, OtherEndsSayHowRunsEndThatDoNotArrive) {
  EXPECT_EQ(explain_other_ends({{NavigationDecision::State::arrived, 5}}, 0), "");
  EXPECT_EQ(explain_other_ends({{NavigationDecision::State::arrived, 5},
                                {NavigationDecision::State::lost, 1},
                                {NavigationDecision::State::unreachable, 3}},
                               2),
            "of the other runs, 2 report an arrival but are farther off, 1 end as lost, 3 end as "
            "unreachable");
  EXPECT_EQ(explain_other_ends({{NavigationDecision::State::arrived, 1},
                                {NavigationDecision::State::unreachable, 3}},
                               1, NavigationDecision::State::unreachable),
            "of the other runs, 1 end as arrived");
}

}  // namespace
}  // namespace panonav::simulation
