#pragma once

#include <vector>

#include "panonav/storage/internal/memory_tables.hpp"

namespace panonav {

/// Finds all faults of a memory: structure, then view by view, then what belongs to the views.
/// Empty: intact.
[[nodiscard]] std::vector<MemoryFile::Fault> verify_memory(MemoryTables& tables,
                                                           const MemoryHeader& header);

/// Finds the faults of links and maps alone, those that lack a view among them.
[[nodiscard]] std::vector<MemoryFile::Fault> verify_links_and_maps(MemoryTables& tables,
                                                                   const MemoryHeader& header);

}  // namespace panonav
