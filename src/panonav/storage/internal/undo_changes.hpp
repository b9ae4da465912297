#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Returns the names of the tables whose rows `undo` restores; each name is followed by a zero byte
/// in memory.
[[nodiscard]] std::vector<std::string_view> undo_table_names();

/// Rows that undoing a change would add, replace or remove.
struct UndoneRows {
  std::vector<ViewId> views;  ///< from all tables, also ends of links; repeated
  std::set<std::string, std::less<>> maps;
  std::set<std::string, std::less<>> routes;
};

/// Parses a kept change of a memory file (a changeset of SQLite's session extension,
/// sqlite.org/sessionintro.html) completely, and returns its rows. Unchecked files from others must
/// not reach SQLite's own reader. Throws Error with the fault unless each row is of a table that
/// can be undone and has all of its columns, types and its key, and nothing follows. Cost: one pass
/// over the bytes.
[[nodiscard]] UndoneRows read_undo_changes(std::span<const std::uint8_t> changes);

}  // namespace panonav
