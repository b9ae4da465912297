#pragma once

#include "bindings.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::python {

/// `VisualMemory` and `MemoryFile` as Python holds them. Of a file even reading takes its only
/// connection, so that every function counts as a change.
using SharedMemory = Shared<VisualMemory>;
using SharedFile = Shared<MemoryFile>;

}  // namespace panonav::python
