#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/navigation/navigation_graph.hpp"

namespace panonav {

/// Options of the direction of motion at a node: how much of the path ahead determines it.
struct FieldOptions {
  /// Number of edges ahead that determine a direction, if the path is straight.
  int links_ahead = 3;
  /// Edges beyond a larger bend are not used, since the path may turn a corner there.
  double max_bend_rad = 0.7854;
};
void visit_options(FieldOptions& options, OptionVisitor& visitor);

/// The next step on the path from one reference view to the goal.
struct Guide {
  /// Length of the path along the edges; infinite if the goal cannot be reached.
  double path_length = std::numeric_limits<double>::infinity();
  std::size_t next = 0;  ///< next node; the node itself at the goal or if unreachable
  std::size_t edge = 0;  ///< edge to `next`
  /// Direction of motion in the frame of the robot that took this view; nullopt at the goal, if
  /// unreachable, and if the motion of the edge is unknown.
  std::optional<double> direction_rad;

  /// True if a path leads to the goal.
  [[nodiscard]] bool is_reachable() const noexcept {
    return path_length < std::numeric_limits<double>::infinity();
  }
};

/// Returns the guide of each node of the whole graph. `blocked`: one entry for each edge, not 0 if
/// blocked (empty: none). Throws ContractError when the goal is not in the graph, OptionError.
[[nodiscard]] std::vector<Guide> direction_field(const NavigationGraph& graph, ViewId goal,
                                                 const FieldOptions& options = {},
                                                 std::span<const std::uint8_t> blocked = {});

}  // namespace panonav
