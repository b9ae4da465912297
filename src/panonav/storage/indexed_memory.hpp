#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "panonav/memory/view_index.hpp"

namespace panonav {

/// Opens the index of the memory at a path or address. Throws FileError as `MemoryFile::open`.
using OpenIndexedMemory =
    std::function<std::unique_ptr<IndexedMemory>(const std::filesystem::path& memory)>;

/// Makes memories that are not held available to `open_indexed_memory` in this process; what was
/// registered before is replaced. Any thread may call.
void register_indexed_memories(OpenIndexedMemory open);

/// Opens the index of a memory that is searched where it lies. Throws FileError as
/// `MemoryFile::open`, and where nothing is registered.
[[nodiscard]] std::unique_ptr<IndexedMemory> open_indexed_memory(
    const std::filesystem::path& memory);

}  // namespace panonav
