#pragma once

#include <filesystem>

#include "panonav/storage/internal/database.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Makes an empty memory file at `path`, whole or not at all. Throws FileError when something is
/// there.
void make_memory_file(const std::filesystem::path& path, const MemoryHeader& header);

/// Opens an existing file after a look at its first bytes. With read_only nothing that is asked of
/// the connection can change the file.
[[nodiscard]] Database open_memory_database(const std::filesystem::path& path, Access access);

/// Gives a checked file of an older version or in another journal mode what changes need. Throws
/// FileError when another program is using it just then.
void prepare_for_changes(Database& database);

}  // namespace panonav
