#include "panonav/navigation/area_planner.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "panonav/core/error.hpp"
#include "support/random_graphs.hpp"

namespace panonav::testing {
namespace {

bool is_connected(const NavigationGraph& graph, const SubAreas& areas, std::size_t area) {
  std::vector<std::size_t> open{areas.nodes[area].front()};
  std::vector<std::uint8_t> seen(graph.size(), 0);
  seen[open.front()] = 1;
  std::size_t count = 0;
  while (!open.empty()) {
    const std::size_t node = open.back();
    open.pop_back();
    ++count;
    for (const auto& exit : graph.exits(node)) {
      if (seen[exit.node] != 0 || areas.area_of[exit.node] != area) continue;
      seen[exit.node] = 1;
      open.push_back(exit.node);
    }
  }
  return count == areas.nodes[area].size();
}

void expect_partition(const NavigationGraph& graph, const SubAreas& areas) {
  std::size_t views = 0;
  for (std::size_t a = 0; a < areas.nodes.size(); ++a) {
    EXPECT_TRUE(std::ranges::is_sorted(areas.nodes[a]));
    EXPECT_TRUE(is_connected(graph, areas, a)) << "area " << a;
    views += areas.nodes[a].size();
    for (std::size_t index = 0; index < areas.nodes[a].size(); ++index) {
      EXPECT_EQ(areas.area_of[areas.nodes[a][index]], a);
      EXPECT_EQ(areas.index_in_area[areas.nodes[a][index]], index);
    }
  }
  EXPECT_EQ(views, graph.size());
  for (std::size_t p = 0; p < graph.edges().size(); ++p) {
    const NavigationGraph::Edge& edge = graph.edges()[p];
    const bool crosses =
        areas.area_of[*graph.node_of(edge.a)] != areas.area_of[*graph.node_of(edge.b)];
    EXPECT_EQ(std::ranges::binary_search(areas.gates, p), crosses);
  }
}

// Rooms of `side` x `side` views, wall by wall, in a row of `rooms`; a door in the middle of each
// wall.
NavigationGraph rooms_in_a_row(int rooms, int side, Random& random) {
  std::vector<Pose2> poses;
  for (int r = 0; r < rooms; ++r) {
    for (int i = 0; i < side * side; ++i) {
      poses.push_back({r * side + i % side + 0.0, i / side + 0.0,
                       random.uniform(-std::numbers::pi, std::numbers::pi)});
    }
  }
  const auto sees = [side](Point2 a, Point2 b) {
    const auto room = [side](Point2 p) { return static_cast<int>(p.x_m) / side; };
    if (room(a) == room(b)) return true;
    return a.y_m == side / 2 && b.y_m == side / 2;
  };
  return posed_graph(poses, 1.5, sees);
}

TEST(SubAreas, TwoRoomsAreCutAtTheirDoor) {
  Random random(1);
  for (const int side : {5, 8, 12}) {
    const NavigationGraph graph = rooms_in_a_row(2, side, random);
    const SubAreas areas = divide_into_areas(graph, {.views_per_area = side * side});
    expect_partition(graph, areas);
    ASSERT_EQ(areas.nodes.size(), 2U);
    EXPECT_EQ(areas.nodes[0].size(), areas.nodes[1].size());
    EXPECT_EQ(areas.gates.size(), 1U);
  }
}

TEST(SubAreas, FiveRoomsAreCutAtTheirDoors) {
  Random random(1);
  const NavigationGraph graph = rooms_in_a_row(5, 7, random);
  const SubAreas areas = divide_into_areas(graph, {.views_per_area = 49});
  expect_partition(graph, areas);
  ASSERT_EQ(areas.nodes.size(), 5U);
  EXPECT_EQ(areas.gates.size(), 4U);
}

TEST(SubAreas, AnyGraphIsDividedIntoConnectedAreasOfSimilarSize) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const NavigationGraph graph = random_graph(300, 250 + 20 * seed, seed);
    expect_partition(graph, divide_into_areas(graph, {.views_per_area = 30}));
  }
  Random random(9);
  std::vector<Pose2> poses;
  for (int i = 0; i < 900; ++i) poses.push_back({i % 30 + 0.0, i / 30 + 0.0, 0.0});
  const NavigationGraph graph = posed_graph(poses, 1.5, [](Point2, Point2) { return true; });
  const SubAreas areas = divide_into_areas(graph, {.views_per_area = 50});
  expect_partition(graph, areas);
  for (const auto& nodes : areas.nodes) {
    EXPECT_GE(nodes.size(), 20U);
    EXPECT_LE(nodes.size(), 71U);
  }
}

TEST(SubAreas, DoorsAreNarrowAndOpenBordersAreNot) {
  Random random(1);
  const int side = 8;
  const NavigationGraph graph = rooms_in_a_row(3, side, random);
  const auto narrow =
      find_bottlenecks(graph, divide_into_areas(graph, {.views_per_area = side * side}), 1);
  for (std::size_t node = 0; node < graph.size(); ++node) {
    const auto column = static_cast<int>(node % side);
    const auto row = static_cast<int>(node / side % side);
    const auto room = static_cast<int>(node / (side * side));
    const auto near = [&](int door_column) {
      return std::abs(column - door_column) <= 1 && std::abs(row - side / 2) <= 1;
    };
    EXPECT_EQ(narrow[node] != 0, (room < 2 && near(side - 1)) || (room > 0 && near(0)));
  }
  std::vector<Pose2> poses;
  for (int i = 0; i < 400; ++i) poses.push_back({i % 20 + 0.0, i / 20 + 0.0, 0.0});
  const NavigationGraph open = posed_graph(poses, 1.5, [](Point2, Point2) { return true; });
  const SubAreas areas = divide_into_areas(open, {.views_per_area = 100});
  ASSERT_GT(areas.nodes.size(), 2U);
  const auto none = find_bottlenecks(open, areas, 2);
  EXPECT_EQ(std::ranges::count(none, std::uint8_t{0}), 400);
}

TEST(AreaPlanner, WithAllGatesEveryWayIsAShortestOne) {
  std::size_t compared = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const NavigationGraph graph = random_graph(120, 130 + 15 * seed, seed);
    AreaPlanner planner(graph, {.areas = {.views_per_area = 15}, .gates_per_border = 0});
    ASSERT_GT(planner.areas().nodes.size(), 4U);
    std::vector<std::uint8_t> closed(graph.edges().size(), 0);
    for (int round = 0; round < 3; ++round) {
      if (round == 1) {
        std::vector<std::size_t> shut;
        for (std::size_t p = seed; p < closed.size(); p += 9) shut.push_back(p);
        for (const std::size_t p : shut) closed[p] = 1;
        planner.block(shut);
        EXPECT_EQ(planner.blocked_edge_count(), shut.size());
      } else if (round == 2) {
        std::ranges::fill(closed, std::uint8_t{0});
        planner.unblock_all();
        EXPECT_EQ(planner.blocked_edge_count(), 0U);
      }
      const auto path_lengths = compute_all_path_lengths(graph, closed);
      for (std::size_t goal = 0; goal < graph.size(); goal += 17) {
        planner.set_goal(graph.view(goal));
        for (std::size_t area = 0; area < planner.areas().nodes.size(); ++area) {
          const auto guides = planner.field(area);
          for (std::size_t index = 0; index < guides.size(); ++index) {
            const std::size_t node = planner.areas().nodes[area][index];
            const double truth = path_lengths[goal * graph.size() + node];
            ASSERT_EQ(guides[index].is_reachable(), std::isfinite(truth));
            if (!guides[index].is_reachable()) continue;
            ASSERT_NEAR(guides[index].path_length, truth, 1e-9);
            ++compared;
          }
        }
        const auto path = planner.plan_path((goal + 40) % graph.size());
        if (!path.empty()) {
          EXPECT_EQ(path.back(), goal);
        }
      }
    }
  }
  EXPECT_GT(compared, 5000U);
}

TEST(AreaPlanner, FewGatesReachTheGoalFromEverywhereByWaysHardlyLonger) {
  Random random(2);
  std::vector<Pose2> poses;
  for (int i = 0; i < 1600; ++i) {
    poses.push_back(
        {i % 40 + 0.0, i / 40 + 0.0, random.uniform(-std::numbers::pi, std::numbers::pi)});
  }
  const NavigationGraph graph = posed_graph(poses, 1.5, [](Point2, Point2) { return true; });
  AreaPlanner planner(graph, {.areas = {.views_per_area = 100}});
  EXPECT_LT(planner.used_gate_count(), planner.areas().gates.size());
  double longer = 0.0;
  int pairs = 0;
  for (int i = 0; i < 40; ++i) {
    const std::size_t goal = random.index(graph.size());
    const std::size_t start = random.index(graph.size());
    if (goal == start) continue;
    planner.set_goal(graph.view(goal));
    const auto flat = direction_field(graph, graph.view(goal));
    const auto path = planner.plan_path(start);
    ASSERT_FALSE(path.empty());
    EXPECT_EQ(path.back(), goal);
    double length = 0.0;
    for (std::size_t k = 0; k + 1 < path.size(); ++k) {
      length += distance(poses[path[k]].position(), poses[path[k + 1]].position());
    }
    EXPECT_GE(length, flat[start].path_length - 1e-9);
    longer += length / flat[start].path_length;
    ++pairs;
  }
  RecordProperty("mean_length_over_shortest", std::to_string(longer / pairs));
  EXPECT_LT(longer / pairs, 1.1);
}

TEST(AreaPlanner, AClosedDoorIsGoneRoundOrMakesTheGoalUnreachable) {
  Random random(1);
  const NavigationGraph graph = rooms_in_a_row(3, 5, random);
  AreaPlanner planner(graph, {.areas = {.views_per_area = 25}});
  planner.set_goal(graph.view(graph.size() - 1));
  ASSERT_FALSE(planner.plan_path(0).empty());
  planner.block(std::vector<std::size_t>{planner.areas().gates.front()});
  EXPECT_TRUE(planner.plan_path(0).empty());
  planner.unblock_all();
  EXPECT_FALSE(planner.plan_path(0).empty());
  EXPECT_THROW(planner.block(std::vector<std::size_t>{99999}), ContractError);
  EXPECT_THROW(planner.set_goal(ViewId{1}), ContractError);
}

}  // namespace
}  // namespace panonav::testing
