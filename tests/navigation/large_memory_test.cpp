// 10,000 references in 50 rooms: every place is found, and one area is held in memory. What it
// costs in time is measured in bench/navigation_bench.cpp.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "navigation/random_graphs.hpp"
#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/navigator.hpp"

namespace panonav {
namespace {

constexpr int rooms_across = 10;
constexpr int rooms_along = 5;
constexpr int room_width = 20;   // views
constexpr int room_height = 10;  // views
constexpr int width = rooms_across * room_width;
constexpr int height = rooms_along * room_height;

// Neighbours of a grid, unless the wall of a room is between them; a door in the middle of a wall.
NavigationGraph rooms() {
  Random random(1);
  std::vector<ViewId> views;
  std::vector<Pose2> poses;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      views.push_back(ViewId{static_cast<std::uint32_t>(views.size())});
      poses.push_back({x + 0.0, y + 0.0, random.uniform(-std::numbers::pi, std::numbers::pi)});
    }
  }
  const auto joined = [](int x, int y, int to_x, int to_y) {
    const bool door_across = y == to_y && y % room_height == room_height / 2;
    const bool door_along = x == to_x && x % room_width == room_width / 2;
    return (x / room_width == to_x / room_width || door_across) &&
           (y / room_height == to_y / room_height || door_along);
  };
  std::vector<Passage> passages;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {1, 1}, {-1, 1}}) {
        const int to_x = x + dx;
        const int to_y = y + dy;
        if (to_x < 0 || to_x >= width || to_y >= height || !joined(x, y, to_x, to_y)) continue;
        const auto a = static_cast<std::size_t>(y * width + x);
        const auto b = static_cast<std::size_t>(to_y * width + to_x);
        passages.push_back({views[a], views[b], std::hypot(dx, dy), inverse(poses[a]) * poses[b]});
      }
    }
  }
  return {views, passages};
}

// Signatures of the usual size, each another one.
VisualMemory memory_of(std::size_t views) {
  constexpr SignatureShape shape{80, 15};
  VisualMemory memory(shape, 1.0F, std::nullopt);
  Random random(2);
  PackedSignature signature{shape, std::vector<std::uint8_t>(shape.size()),
                            std::vector<std::uint8_t>(shape.size())};
  for (std::size_t i = 0; i < views; ++i) {
    for (std::size_t k = 0; k < shape.size(); ++k) {
      const std::uint64_t bits = random.next();
      signature.magnitudes[k] = static_cast<std::uint8_t>(1 + bits % 255);
      signature.phases[k] = static_cast<std::uint8_t>(bits >> 32U);
    }
    memory.append(signature, {"view_" + std::to_string(i), std::nullopt, std::nullopt});
  }
  return memory;
}

TEST(LargeMemory, EveryPlaceIsFoundWithOneAreaInMemory) {
  const NavigationGraph graph = rooms();
  ASSERT_EQ(graph.size(), 10000U);
  const AreaPlanner planner(graph);
  const SubAreas& areas = planner.areas();
  EXPECT_GE(areas.nodes.size(), 40U);
  EXPECT_LE(areas.nodes.size(), 70U);
  // Cut at the walls: hardly any area holds views of two rooms.
  std::size_t doors = 0;
  for (const std::size_t gate : areas.gates) {
    const auto a = static_cast<int>(graph.passages()[gate].a.value);
    const auto b = static_cast<int>(graph.passages()[gate].b.value);
    doors += a % width / room_width != b % width / room_width ||
             a / width / room_height != b / width / room_height;
  }
  EXPECT_GE(doors, areas.gates.size() * 3 / 4);

  AreaPlanner planning = planner;
  Random random(3);
  for (int i = 0; i < 10; ++i) {
    planning.set_goal(graph.view(random.index(graph.size())));
    for (const Guide& guide : planning.field(random.index(areas.nodes.size()))) {
      EXPECT_TRUE(guide.reachable());
    }
  }

  const VisualMemory memory = memory_of(graph.size());
  const MemoryViewSource source(memory);
  Navigator navigator(source, planner);
  navigator.set_goal(graph.view(9999));
  planning.set_goal(graph.view(9999));
  const auto way = planning.planned_way(0);
  ASSERT_GT(way.size(), 100U);
  std::set<std::size_t> entered;
  for (const std::size_t node : way) {
    const auto decision = navigator.look(memory.signature(graph.view(node)));
    EXPECT_EQ(decision.nearest, graph.view(node));
    EXPECT_EQ(decision.area, areas.area_of[node]);
    entered.insert(decision.area);
    // An area and those views of its neighbours that its gates lead to.
    EXPECT_LT(navigator.loaded_views(), 600U);
  }
  EXPECT_GT(entered.size(), 5U);
}

}  // namespace
}  // namespace panonav
