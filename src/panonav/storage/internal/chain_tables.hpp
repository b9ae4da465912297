#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/homing/snapshot_chain.hpp"
#include "panonav/storage/internal/database.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Named chains of snapshots in a memory file, within the caller's transaction. The tables must be
/// there (memory_schema.hpp). All throw FileError on damage.

/// Replaces the chain of that name. Throws ContractError on an empty name and as `validate`.
void write_chain(Database& database, std::string_view name, const SnapshotChain& chain);
/// Empty when there is no such chain.
[[nodiscard]] std::optional<SnapshotChain> read_chain(Database& database, std::string_view name);
/// Whether there was one.
bool erase_chain(Database& database, std::string_view name);
/// All names, ascending.
[[nodiscard]] std::vector<std::string> chain_names(Database& database);
/// Passes every part to `check` that may throw; `check` keeps what it threw.
void verify_chains(Database& database,
                   const std::function<void(const std::function<void()>&)>& check);

}  // namespace panonav
