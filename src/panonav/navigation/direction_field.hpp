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

/// Distance ahead of a node at which its direction of motion is read.
struct FieldOptions {
  /// Edges ahead that count for a direction, as far as the path is straight.
  int links_ahead = 3;
  /// Edges beyond a larger bend do not count: the path may turn a corner there.
  double max_bend_rad = 0.7854;
};
void visit_options(FieldOptions& options, OptionVisitor& visitor);

/// The way from one reference view to the goal.
struct Guide {
  /// Length of the path along the edges; infinite where the goal cannot be reached.
  double path_length = std::numeric_limits<double>::infinity();
  std::size_t next = 0;  ///< next node; the node itself at the goal, or when unreachable
  std::size_t edge = 0;  ///< that leads there
  /// Direction of motion in the frame of the robot that took this view. Empty at the goal, when
  /// unreachable, and where no edge has a motion.
  std::optional<double> direction_rad;

  /// True if a path leads to the goal.
  [[nodiscard]] bool is_reachable() const noexcept {
    return path_length < std::numeric_limits<double>::infinity();
  }
};

/// Returns the guide of each node of the whole graph; `blocked` edges are not 0 (empty: none).
/// Throws ContractError when the goal is not in the graph, OptionError.
[[nodiscard]] std::vector<Guide> direction_field(const NavigationGraph& graph, ViewId goal,
                                                 const FieldOptions& options = {},
                                                 std::span<const std::uint8_t> blocked = {});

}  // namespace panonav
