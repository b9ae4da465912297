#pragma once

#include <vector>

#include "panonav/storage/internal/memory_tables.hpp"

namespace panonav {

/// Finds all faults of a memory: of its structure, of each view, then of attachments, links, maps
/// and routes. Returns none if it is intact.
[[nodiscard]] std::vector<MemoryFile::Fault> verify_memory(MemoryTables& tables,
                                                           const MemoryHeader& header);

/// Finds the faults of links and maps only, also views that they lack.
[[nodiscard]] std::vector<MemoryFile::Fault> verify_links_and_maps(MemoryTables& tables,
                                                                   const MemoryHeader& header);

/// Undoes the newest change within a writing transaction. Throws as `MemoryFile::undo`.
void undo_newest_change(MemoryTables& tables, const MemoryHeader& header);

}  // namespace panonav
