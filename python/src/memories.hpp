#pragma once

#include "bindings.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::python {

/// `VisualMemory` and `MemoryFile` for Python. A file has one connection, which reading uses,
/// too, so nearly all its functions use `change`.
using SharedMemory = Shared<VisualMemory>;
using SharedFile = Shared<MemoryFile>;

}  // namespace panonav::python
