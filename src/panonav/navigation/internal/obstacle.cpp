#include "panonav/navigation/internal/obstacle.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "panonav/core/error.hpp"

namespace panonav {

std::vector<std::size_t> find_crossed_edges(const NavigationGraph& graph, const Obstacle& obstacle,
                                            int links) {
  require(obstacle.node < graph.size(), "node of an obstacle", static_cast<double>(obstacle.node),
          "a node of the graph");
  require(std::isfinite(obstacle.direction_rad), "direction_rad", obstacle.direction_rad, "finite");
  require(std::isfinite(obstacle.distance) && obstacle.distance >= 0.0, "distance",
          obstacle.distance, ">= 0 and finite");
  require(std::isfinite(obstacle.half_width) && obstacle.half_width >= 0.0, "half_width",
          obstacle.half_width, ">= 0 and finite");
  // Poses of the nodes around, in a frame whose x axis is the direction of motion.
  std::map<std::size_t, Pose2> placed{
      {obstacle.node, inverse(Pose2{0.0, 0.0, obstacle.direction_rad})}};
  std::vector<std::size_t> front{obstacle.node};
  for (int i = 0; i < links; ++i) {
    std::vector<std::size_t> next;
    for (const std::size_t node : front) {
      for (const NavigationGraph::Exit& exit : graph.exits(node)) {
        const auto motion = graph.motion_from(node, exit.edge);
        if (motion && placed.try_emplace(exit.node, placed.at(node) * *motion).second) {
          next.push_back(exit.node);
        }
      }
    }
    front.swap(next);
  }
  std::vector<std::size_t> crossed;
  for (const auto& [node, pose] : placed) {
    for (const NavigationGraph::Exit& exit : graph.exits(node)) {
      if (exit.node < node || !graph.motion_from(node, exit.edge)) continue;
      const auto other = placed.find(exit.node);
      if (other == placed.end()) continue;
      const double before = pose.x_m - obstacle.distance;
      const double beyond = other->second.x_m - obstacle.distance;
      if ((before < 0.0) == (beyond < 0.0)) continue;
      const double share = before / (before - beyond);
      const double y = pose.y_m + share * (other->second.y_m - pose.y_m);
      if (std::abs(y) <= obstacle.half_width) crossed.push_back(exit.edge);
    }
  }
  std::ranges::sort(crossed);
  return crossed;
}

}  // namespace panonav
