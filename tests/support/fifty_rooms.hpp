#pragma once

// A large memory: 10,000 references in 50 rooms.

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/navigation/navigation_graph.hpp"

namespace panonav::testing {

inline constexpr int rooms_across = 10;
inline constexpr int rooms_along = 5;
inline constexpr int room_width = 20;   // views
inline constexpr int room_height = 10;  // views
inline constexpr int width = rooms_across * room_width;
inline constexpr int height = rooms_along * room_height;

// Neighbours of a grid, unless the wall of a room is between them; a door in the middle of a wall.
inline NavigationGraph graph_of_rooms() {
  Random random(1);
  std::vector<ViewId> views;
  std::vector<Pose2> poses;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      views.push_back(ViewId{static_cast<std::uint32_t>(views.size() + 1)});
      poses.push_back({x + 0.0, y + 0.0, random.uniform(-std::numbers::pi, std::numbers::pi)});
    }
  }
  const auto joined = [](int x, int y, int to_x, int to_y) {
    const bool door_across = y == to_y && y % room_height == room_height / 2;
    const bool door_along = x == to_x && x % room_width == room_width / 2;
    return (x / room_width == to_x / room_width || door_across) &&
           (y / room_height == to_y / room_height || door_along);
  };
  std::vector<NavigationGraph::Edge> edges;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {1, 1}, {-1, 1}}) {
        const int to_x = x + dx;
        const int to_y = y + dy;
        if (to_x < 0 || to_x >= width || to_y >= height || !joined(x, y, to_x, to_y)) continue;
        const auto a = static_cast<std::size_t>(y * width + x);
        const auto b = static_cast<std::size_t>(to_y * width + to_x);
        edges.push_back({views[a], views[b], std::hypot(dx, dy), inverse(poses[a]) * poses[b]});
      }
    }
  }
  return {views, edges};
}

// Signatures of the usual size, each another one, of the views 1, 2, .. as in a file.
inline VisualMemory memory_of(std::size_t views) {
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
    memory.append_with_id(ViewId{static_cast<std::uint32_t>(i + 1)}, signature,
                          {"view_" + std::to_string(i), std::nullopt, std::nullopt});
  }
  return memory;
}

}  // namespace panonav::testing
