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

/// Named maps in a memory file, within the caller's transaction. All throw FileError on damage.

/// Replaces the map of that name. Throws ContractError on an empty name and as `validate`.
void write_map(MemoryTables& tables, std::string_view name, const TopologicalMap& map);
/// Empty when there is no such map.
[[nodiscard]] std::optional<TopologicalMap> read_map(MemoryTables& tables, std::string_view name);
/// Returns true if there was one.
bool erase_map(MemoryTables& tables, std::string_view name);
/// Removes views from a map, with their edges, and numbers its components again. Returns true if
/// one was in it.
bool forget_views(TopologicalMap& map, const std::set<ViewId>& forgotten);
/// Drops the nodes of these views, and their edges, from all maps.
void erase_views_from_maps(MemoryTables& tables, std::span<const ViewId> views);
/// Passes every map to `check` that may throw; `check` keeps what it threw. `known` says whether a
/// view is there.
void verify_maps(MemoryTables& tables, const std::function<bool(ViewId)>& known,
                 const std::function<void(const std::function<void()>&)>& check);

}  // namespace panonav
