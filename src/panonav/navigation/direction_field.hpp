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

/// How far ahead a direction looks.
struct FieldOptions {
  /// So many edges ahead count for a direction, where the way does not bend away.
  int links_ahead = 3;
  /// A way that has bent by more is not looked along any further: it may go round a corner.
  double max_bend_rad = 0.7854;
};
void visit_options(FieldOptions& options, OptionVisitor& visitor);

/// What a reference view says of the way to the goal.
struct Guide {
  /// Length of the way along the edges; infinite: the goal cannot be reached from here.
  double way = std::numeric_limits<double>::infinity();
  std::size_t next = 0;  ///< node after this one; itself at the goal, or when unreachable
  std::size_t edge = 0;  ///< that leads there
  /// The direction of motion in the frame of the robot that took this view. Empty at the goal, when
  /// unreachable, and where nothing tells.
  std::optional<double> direction_rad;

  /// Whether a way leads to the goal from here.
  [[nodiscard]] bool reachable() const noexcept {
    return way < std::numeric_limits<double>::infinity();
  }
};

/// The whole graph at once: for each node its guide towards the goal. Throws ContractError when the
/// goal is not in the graph, OptionError.
[[nodiscard]] std::vector<Guide> direction_field(const NavigationGraph& graph, ViewId goal,
                                                 const FieldOptions& options = {},
                                                 std::span<const std::uint8_t> closed = {});

}  // namespace panonav
