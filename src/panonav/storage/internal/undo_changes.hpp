#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Returns the names of the tables whose rows `undo` brings back, each with a zero byte behind it.
[[nodiscard]] std::vector<std::string_view> undo_table_names();

/// Rows that kept changes would bring back, replace or drop.
struct UndoneRows {
  std::vector<ViewId> views;  ///< of all tables, ends of links too; with repetitions
  std::set<std::string, std::less<>> maps;
  std::set<std::string, std::less<>> routes;
};

/// Reads kept changes of a memory file (a changeset of SQLite's session extension,
/// sqlite.org/sessionintro.html) to their last byte, and returns their rows: files of others must
/// not reach SQLite's own reader unchecked. Throws Error that states the fault unless each change
/// is one of a table that can be undone, with all of its columns, their types and its key, and
/// nothing follows. Cost: one pass over the bytes.
[[nodiscard]] UndoneRows read_undo_changes(std::span<const std::uint8_t> changes);

}  // namespace panonav
