#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "panonav/storage/internal/memory_tables.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Creates a memory in a file or on a server with the content that `fill` writes, completely or not
/// at all. Throws FileError if there is something at `path`.
void create_memory_tables(const std::filesystem::path& path, const MemoryHeader& header,
                          const std::function<void(MemoryTables&)>& fill);

struct OpenedMemory {
  std::unique_ptr<MemoryTables> tables;
  MemoryHeader header;
};

/// Opens an existing memory on a server, or a file whose first bytes it checks before; then it
/// checks schema and header. With read_only nothing can change the file. With read_write it
/// switches a file of another journal mode to a write-ahead log. Throws FileError if the memory is
/// missing, damaged or of another format version, if the file is no memory file or there is no
/// permission, or if another program is using it at this moment.
[[nodiscard]] OpenedMemory open_memory_tables(const std::filesystem::path& path, Access access);

}  // namespace panonav
