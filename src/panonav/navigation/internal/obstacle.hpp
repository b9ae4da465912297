#pragma once

#include <cstddef>
#include <vector>

#include "panonav/navigation/navigation_graph.hpp"

namespace panonav {

/// An obstacle near a reference view: a bar across the direction of motion.
struct Obstacle {
  std::size_t node = 0;        ///< of the view
  double direction_rad = 0.0;  ///< towards the obstacle, in the frame of that view
  double distance = 0.0;       ///< in the graph's unit, >= 0
  double half_width = 0.0;     ///< in the graph's unit, >= 0
};

/// Returns the edges that cross the bar, ascending; for a closed door, all edges through it.
/// Considers nodes up to `links` edges away; their positions come from chaining motions along the
/// fewest edges. Throws ContractError if there is no such node or a number is negative or not
/// finite.
[[nodiscard]] std::vector<std::size_t> find_crossed_edges(const NavigationGraph& graph,
                                                          const Obstacle& obstacle, int links = 2);

}  // namespace panonav
