#pragma once

#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/mapping/topological_map.hpp"
#include "panonav/storage/internal/memory_tables.hpp"

namespace panonav {

/// Named maps of a memory; call the functions within a transaction. All throw FileError on damage.

/// Replaces the map of that name. Throws ContractError on an empty name and as `validate`.
void write_map(MemoryTables& tables, std::string_view name, const TopologicalMap& map);
/// Returns the map of that name; nullopt if there is none.
[[nodiscard]] std::optional<TopologicalMap> read_map(MemoryTables& tables, std::string_view name);
/// Removes a map; false if there was none.
bool erase_map(MemoryTables& tables, std::string_view name);
/// Removes views and their edges from a map and renumbers its components. Returns true if the map
/// had one of the views.
bool remove_views_from_map(TopologicalMap& map, const std::set<ViewId>& forgotten);
/// Removes these views, as nodes with their edges, from all maps.
void erase_views_from_maps(MemoryTables& tables, std::span<const ViewId> views);
/// Checks every map: passes each part, which may throw, to `check`, which must collect the errors.
/// `known` returns true if a view is in the memory.
void verify_maps(MemoryTables& tables, const std::function<bool(ViewId)>& known,
                 const std::function<void(const std::function<void()>&)>& check);

}  // namespace panonav
