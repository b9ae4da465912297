#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/navigation/direction_field.hpp"
#include "panonav/navigation/sub_areas.hpp"

namespace panonav {

/// A node from which path lengths are counted.
struct SearchRoot {
  std::size_t node = 0;      ///< of the area that is searched
  double path_length = 0.0;  ///< from the root to the goal, >= 0
  std::size_t next = 0;      ///< beyond the root; the root itself where the goal is
  std::size_t edge = 0;      ///< that leads there
};

/// Searches [M04 section 3.5] from the roots over the nodes of one area and all edges whose entry
/// in `blocked` is 0 (empty: all). Returns guides without directions, in the order of the area's
/// nodes. Of equal paths that over the lower node counts. Throws ContractError on roots outside of
/// the area, numbers out of range or spans of another size. Cost: O((nodes + edges) log nodes).
[[nodiscard]] std::vector<Guide> search_area(const NavigationGraph& graph, const SubAreas& areas,
                                             std::size_t area, std::span<const SearchRoot> roots,
                                             std::span<const std::uint8_t> blocked);

/// Sets the directions of an area's guides: towards the next nodes, whose motions are chained.
/// Beyond the area only the first node counts. Throws OptionError.
void set_directions(const NavigationGraph& graph, const SubAreas& areas, std::size_t area,
                    const FieldOptions& options, std::span<Guide> guides);

}  // namespace panonav
