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

/// Named route panoramas of a memory, whose tables must exist (memory_schema.hpp). Call the
/// functions within a transaction. All throw FileError on damage.

/// Appends the lines of `more` to the route of that name, which is created if it is missing, and
/// returns how many were added: first lines within a millimetre of the last stored line are
/// skipped. Throws ContractError on an empty name, a route without lines, or another number of
/// columns than the stored route's. Cost: that of `more` and of at most one more block of lines.
std::size_t append_to_route(MemoryTables& tables, std::string_view name, const RoutePanorama& more);
/// Returns the route of that name; nullopt if there is none.
[[nodiscard]] std::optional<RoutePanorama> read_route(MemoryTables& tables, std::string_view name);
/// Renames a route, which must exist; the new name must be free.
void rename_route(MemoryTables& tables, std::string_view name, std::string_view new_name);
/// Removes a route; false if there was none.
bool erase_route(MemoryTables& tables, std::string_view name);
/// Checks every route: passes each part, which may throw, to `check`, which must collect the
/// errors.
void verify_routes(MemoryTables& tables,
                   const std::function<void(const std::function<void()>&)>& check);

}  // namespace panonav
