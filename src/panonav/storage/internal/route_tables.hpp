#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/route/route_panorama.hpp"
#include "panonav/route/snapshot_chain.hpp"
#include "panonav/storage/internal/memory_tables.hpp"

namespace panonav {

/// Named routes of a memory, panoramas and chains, whose tables must exist (memory_schema.hpp).
/// Call the functions within a transaction. All throw FileError on damage, and if the route was
/// recorded by the other method.

/// Appends the lines of `more` to the route of that name, which is created if it is missing, and
/// returns how many were added: first lines within a millimetre of the last stored line are
/// skipped. Throws ContractError on an empty name, a route without lines, or another number of
/// columns than the stored route's. Cost: that of `more` and of at most one more block of lines.
std::size_t append_to_route(MemoryTables& tables, std::string_view name, const RoutePanorama& more);
/// Returns the route of that name; nullopt if there is none.
[[nodiscard]] std::optional<RoutePanorama> read_route(MemoryTables& tables, std::string_view name);
/// Stores a chain in its packed form. Throws ContractError on a name that is empty or in use, and
/// as `SnapshotChain::pack`.
void write_chain(MemoryTables& tables, std::string_view name, const SnapshotChain& chain);
/// Returns the chain of that name; nullopt if there is none.
[[nodiscard]] std::optional<SnapshotChain> read_chain(MemoryTables& tables, std::string_view name);
/// Returns how the route was recorded; nullopt if there is none. Cost: that of two look-ups.
[[nodiscard]] std::optional<RouteMethod> read_route_method(MemoryTables& tables,
                                                           std::string_view name);
/// Returns the names of all routes, also of those that one of the tables has lost.
[[nodiscard]] std::set<std::string> list_stored_routes(MemoryTables& tables);
/// Copies a route, which must exist, to other tables.
void copy_route(MemoryTables& from, MemoryTables& to, std::string_view name);
/// Checks a route with all its blocks, if there is one.
void check_route(MemoryTables& tables, std::string_view name);
/// Renames a route, which must exist; the new name must be free.
void rename_route(MemoryTables& tables, std::string_view name, std::string_view new_name);
/// Removes a route; false if there was none.
bool erase_route(MemoryTables& tables, std::string_view name);
/// Checks every route: passes each part, which may throw, to `check`, which must collect the
/// errors.
void verify_routes(MemoryTables& tables,
                   const std::function<void(const std::function<void()>&)>& check);

}  // namespace panonav
