#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/route/route_panorama.hpp"
#include "panonav/storage/internal/memory_tables.hpp"

namespace panonav {

/// Named route panoramas in a memory file, within the caller's transaction. The tables must be
/// there (memory_schema.hpp). All throw FileError on damage.

/// Adds the lines of `more` behind those of the route of that name, which is made where there is
/// none, and returns how many: the first ones are left out while they are within a millimetre of
/// the last line there. Throws ContractError on an empty name, a route without lines, and another
/// number of columns than the route's. Cost: that of `more` and at most one block of lines.
std::size_t append_to_route(MemoryTables& tables, std::string_view name, const RoutePanorama& more);
/// Empty when there is no such route.
[[nodiscard]] std::optional<RoutePanorama> read_route(MemoryTables& tables, std::string_view name);
/// Renames a route; there must be one of the old name and none of the new one.
void rename_route(MemoryTables& tables, std::string_view name, std::string_view new_name);
/// Returns true if there was one.
bool erase_route(MemoryTables& tables, std::string_view name);
/// Passes every part to `check` that may throw; `check` keeps what it threw.
void verify_routes(MemoryTables& tables,
                   const std::function<void(const std::function<void()>&)>& check);

}  // namespace panonav
