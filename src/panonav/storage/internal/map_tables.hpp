#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/mapping/topological_map.hpp"
#include "panonav/storage/internal/database.hpp"

namespace panonav {

/// Named maps in a memory file, within the caller's transaction. The table must be there
/// (memory_schema.hpp). All throw FileError on damage.

/// Replaces the map of that name. Throws ContractError on an empty name and as `validate`.
void write_map(Database& database, std::string_view name, const TopologicalMap& map);
/// Empty when there is no such map.
[[nodiscard]] std::optional<TopologicalMap> read_map(Database& database, std::string_view name);
/// Whether there was one.
bool erase_map(Database& database, std::string_view name);
/// All names, ascending.
[[nodiscard]] std::vector<std::string> map_names(Database& database);
/// Drops the nodes of these views, and their edges, from all maps.
void forget_in_maps(Database& database, std::span<const ViewId> views);
/// Passes every map to `check` that may throw; `check` keeps what it threw. `known` says whether a
/// view is there.
void verify_maps(Database& database, const std::function<bool(ViewId)>& known,
                 const std::function<void(const std::function<void()>&)>& check);

}  // namespace panonav
