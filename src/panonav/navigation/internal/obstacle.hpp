#pragma once

#include <cstddef>
#include <vector>

#include "panonav/navigation/navigation_graph.hpp"

namespace panonav {

/// Something in the way, seen from a reference view: a bar across the direction of motion.
struct Obstacle {
  std::size_t node = 0;        ///< the robot is near this view
  double direction_rad = 0.0;  ///< towards the obstacle, in the frame of that view
  double distance = 0.0;       ///< in the graph's unit, >= 0
  double half_width = 0.0;     ///< in the graph's unit, >= 0
};

/// The edges around that cross the bar, ascending: where a door is shut, all those through it.
/// Nodes up to `links` edges away count, placed by chaining motions along the fewest edges.
/// Throws ContractError when there is no such node or a number is not finite or negative.
[[nodiscard]] std::vector<std::size_t> edges_across(const NavigationGraph& graph,
                                                    const Obstacle& obstacle, int links = 2);

}  // namespace panonav
