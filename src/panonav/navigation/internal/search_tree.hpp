#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/navigation/direction_field.hpp"
#include "panonav/navigation/sub_areas.hpp"

namespace panonav {

/// A node from which the search starts: the goal or a gate of the area.
struct SearchRoot {
  std::size_t node = 0;      ///< node of the searched area
  double path_length = 0.0;  ///< from the root to the goal, >= 0
  std::size_t next = 0;      ///< next node after the root; the root itself if it is the goal
  std::size_t edge = 0;      ///< edge to `next`
};

/// Searches shortest paths [M04 section 3.5] from the nodes of one area to the roots, over all
/// edges whose entry in `blocked` is 0 (empty: all). Returns guides without directions, in the
/// order of the area's nodes. Of equally long paths, takes the one over the lower node. Throws
/// ContractError on roots outside of the area, numbers out of range or spans of another size. Cost:
/// O((nodes + edges) log nodes).
[[nodiscard]] std::vector<Guide> search_area(const NavigationGraph& graph, const SubAreas& areas,
                                             std::size_t area, std::span<const SearchRoot> roots,
                                             std::span<const std::uint8_t> blocked);

/// Sets the directions of an area's guides by chaining the motions to the next nodes. Of the nodes
/// beyond the area, uses only the first. Throws OptionError.
void set_directions(const NavigationGraph& graph, const SubAreas& areas, std::size_t area,
                    const FieldOptions& options, std::span<Guide> guides);

}  // namespace panonav
