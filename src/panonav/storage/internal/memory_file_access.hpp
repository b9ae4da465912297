#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "panonav/storage/internal/memory_tables.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Makes a memory, in a file or on a server, with what `fill` writes, whole or not at all. Throws
/// FileError when something is there.
void create_memory_tables(const std::filesystem::path& path, const MemoryHeader& header,
                          const std::function<void(MemoryTables&)>& fill);

struct OpenedMemory {
  std::unique_ptr<MemoryTables> tables;
  MemoryHeader header;
};

/// Opens an existing memory on a server, or a file after checking its first bytes, and checks its
/// schema and header. With read_only nothing can change the file. A file in another journal mode is
/// given what changes need. Throws FileError: missing, no memory file, of another format version,
/// damaged, no permission, or another program is using it just then.
[[nodiscard]] OpenedMemory open_memory_tables(const std::filesystem::path& path, Access access);

}  // namespace panonav
