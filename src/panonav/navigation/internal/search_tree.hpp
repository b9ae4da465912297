#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/navigation/direction_field.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/navigation/sub_areas.hpp"

namespace panonav {

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

}  // namespace panonav
