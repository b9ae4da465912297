// 10,000 references in 50 rooms: every place is found, and one area is held in memory. What it
// costs in time is measured in bench/navigation_bench.cpp.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/navigator.hpp"
#include "support/fifty_rooms.hpp"

namespace panonav::testing {
namespace {

TEST(LargeMemory, EveryPlaceIsFoundWithOneAreaInMemory) {
  const NavigationGraph graph = graph_of_rooms();
  ASSERT_EQ(graph.size(), 10000U);
  const AreaPlanner planner(graph);
  const SubAreas& areas = planner.areas();
  EXPECT_GE(areas.nodes.size(), 40U);
  EXPECT_LE(areas.nodes.size(), 70U);
  // Cut at the walls: hardly any area holds views of two rooms.
  std::size_t doors = 0;
  for (const std::size_t gate : areas.gates) {
    const auto a = static_cast<int>(*graph.node_of(graph.edges()[gate].a));
    const auto b = static_cast<int>(*graph.node_of(graph.edges()[gate].b));
    doors += a % width / room_width != b % width / room_width ||
             a / width / room_height != b / width / room_height;
  }
  EXPECT_GE(doors, areas.gates.size() * 3 / 4);

  AreaPlanner planning = planner;
  Random random(3);
  for (int i = 0; i < 10; ++i) {
    planning.set_goal(graph.view(random.index(graph.size())));
    for (const Guide& guide : planning.field(random.index(areas.nodes.size()))) {
      EXPECT_TRUE(guide.is_reachable());
    }
  }

  const VisualMemory memory = memory_of(graph.size());
  const MemoryViewSource source(memory);
  Navigator navigator(source, planner);
  navigator.set_goal(graph.view(9999));
  planning.set_goal(graph.view(9999));
  const auto way = planning.plan_path(0);
  ASSERT_GT(way.size(), 100U);
  std::set<std::size_t> entered;
  for (const std::size_t node : way) {
    const auto decision = navigator.observe(memory.signature(graph.view(node)));
    EXPECT_EQ(decision.nearest, graph.view(node));
    EXPECT_EQ(decision.area, areas.area_of[node]);
    entered.insert(decision.area);
    // An area and those views of its neighbours that its gates lead to.
    EXPECT_LT(navigator.loaded_view_count(), 600U);
  }
  EXPECT_GT(entered.size(), 5U);
}

}  // namespace
}  // namespace panonav::testing
