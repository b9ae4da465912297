#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/navigation/sub_areas.hpp"

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

/// A node from which ways are counted, and the way that is left from there.
struct SearchRoot {
  std::size_t node = 0;  ///< of the area that is searched
  double way = 0.0;      ///< from the root to the goal, >= 0
  std::size_t next = 0;  ///< beyond the root; the root itself where the goal is
  std::size_t edge = 0;  ///< that leads there
};

/// The search tree of [M04 section 3.5] from its roots over the nodes of one area and all edges
/// for which `closed` is 0 (empty: all), without directions. By place in the area. Ties are decided
/// by the lower node. Roots must lie in the area. Throws ContractError on numbers out of range or
/// spans of another size. Cost: O((nodes + edges) log nodes) of the area.
[[nodiscard]] std::vector<Guide> search_tree(const NavigationGraph& graph, const SubAreas& areas,
                                             std::size_t area, std::span<const SearchRoot> roots,
                                             std::span<const std::uint8_t> closed);

/// Fills in the directions of an area's guides: towards where the next nodes lie, whose motions are
/// chained. What lies beyond the area is looked at no further than its first node. Throws
/// OptionError.
void set_directions(const NavigationGraph& graph, const SubAreas& areas, std::size_t area,
                    const FieldOptions& options, std::span<Guide> guides);

/// The whole graph at once: for each node its guide towards the goal. Throws ContractError when the
/// goal is not in the graph, OptionError.
[[nodiscard]] std::vector<Guide> direction_field(const NavigationGraph& graph, ViewId goal,
                                                 const FieldOptions& options = {},
                                                 std::span<const std::uint8_t> closed = {});

}  // namespace panonav
