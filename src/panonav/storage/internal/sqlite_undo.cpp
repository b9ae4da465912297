// Undoes the last changes of an SQLite file, by the session extension.

#define SQLITE_ENABLE_SESSION
#define SQLITE_ENABLE_PREUPDATE_HOOK
#include <sqlite3.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/route_tables.hpp"
#include "panonav/storage/internal/sqlite_tables.hpp"
#include "panonav/storage/internal/undo_changes.hpp"
#include "panonav/storage/memory_header.hpp"

namespace panonav {

namespace {

struct EndSession {
  void operator()(sqlite3_session* session) const noexcept { sqlite3session_delete(session); }
};

// Frees bytes that SQLite allocated.
struct FreeBytes {
  void operator()(void* bytes) const noexcept { sqlite3_free(bytes); }
};
struct SqliteBytes {
  int size = 0;
  std::unique_ptr<void, FreeBytes> data;
  [[nodiscard]] std::span<const std::uint8_t> bytes() const {
    return {static_cast<const std::uint8_t*>(data.get()), static_cast<std::size_t>(size)};
  }
};

// The newest change first.
constexpr const char* select_history =
    "SELECT id, what, stamp_s, changes, checksum FROM history ORDER BY id DESC";

// Returns the kept rows of a change; empty also if only its description is left.
std::span<const std::uint8_t> read_changes(const Statement& row) {
  if (row.is_null(3)) return {};
  return row.blob(3);
}

// Steps to the next change and returns its rows; nullopt if there is none. It checks the change
// first, so that SQLite's own reader gets only valid ones.
std::optional<UndoneRows> step_to_next_change(Database& database, Statement& row) {
  if (!row.step()) return std::nullopt;
  const auto changes = read_changes(row);
  if (row.integer(4) != undo_checksum(row.text(1), row.real(2), changes)) {
    database.fail_damaged("a change that can be undone does not match its checksum");
  }
  try {
    return read_undo_changes(changes);
  } catch (const Error& error) {
    database.fail_damaged(error.what());
  }
}

double unix_time_s() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

// Newer settings stay, because settings are notes about the views, which are checked when they are
// used.
int on_conflict(void* conflicting_table, int, sqlite3_changeset_iter* change) {
  const char* table = nullptr;
  int columns = 0;
  int operation = 0;
  int indirect = 0;
  sqlite3changeset_op(change, &table, &columns, &operation, &indirect);
  if (std::string_view(table) == "settings") return SQLITE_CHANGESET_OMIT;
  *static_cast<std::string*>(conflicting_table) = table;
  return SQLITE_CHANGESET_ABORT;
}

}  // namespace

void SqliteTables::run_undoably(const std::function<void()>& changes, const std::string& what) {
  const auto check = [&](int code) {
    if (code != SQLITE_OK) database_.fail(code);
  };
  sqlite3_session* started = nullptr;
  check(sqlite3session_create(database_.handle(), "main", &started));
  std::unique_ptr<sqlite3_session, EndSession> session(started);
  for (const std::string_view table : undo_table_names()) {
    check(sqlite3session_attach(started, table.data()));
  }
  changes();
  SqliteBytes made;
  void* data = nullptr;
  check(sqlite3session_changeset(session.get(), &made.size, &data));
  made.data.reset(data);
  session.reset();
  require_undo_bytes(path_, made.size);
  const double stamp_s = unix_time_s();
  if (run_statement(database_,
                    "INSERT INTO history(what, stamp_s, changes, checksum) VALUES(?, ?, ?, ?)",
                    what, stamp_s, made.bytes(), undo_checksum(what, stamp_s, made.bytes())) != 0) {
    fail_damaged("table history");
  }
  shorten_history();
}

void SqliteTables::shorten_history() {
  struct Old {
    std::int64_t id;
    std::string what;
    double stamp_s;
  };
  std::vector<Old> old;
  std::vector<std::int64_t> gone;
  {
    Statement row(database_,
                  "SELECT id, what, stamp_s, length(changes) FROM history ORDER BY id DESC");
    std::uint64_t bytes = 0;
    for (std::size_t level = 0; row.step(); ++level) {
      const bool is_kept = !row.is_null(3);
      bytes += is_kept ? static_cast<std::uint64_t>(row.integer(3)) : 0;
      const bool fits = level == 0 || (level < MemoryFile::max_undo_levels &&
                                       bytes <= MemoryFile::max_history_bytes);
      if (level >= MemoryFile::max_history) {
        gone.push_back(row.integer(0));
      } else if (is_kept && !fits) {
        old.push_back({row.integer(0), std::string(row.text(1)), row.real(2)});
      }
    }
  }
  Statement forget(database_, "UPDATE history SET changes = NULL, checksum = ? WHERE id = ?");
  for (const Old& change : old) {
    forget.bind_all(undo_checksum(change.what, change.stamp_s, {}), change.id).run();
  }
  Statement erase(database_, "DELETE FROM history WHERE id = ?");
  for (const std::int64_t id : gone) erase.bind(1, id).run();
}

std::vector<MemoryFile::KeptChange> SqliteTables::history() {
  std::vector<MemoryFile::KeptChange> changes;
  Statement row(database_, select_history);
  while (step_to_next_change(database_, row)) {
    changes.push_back(
        {std::string(row.text(1)), row.real(2), read_changes(row).size(), !row.is_null(3)});
  }
  return changes;
}

void SqliteTables::require_intact(UndoneRows rows) {
  std::ranges::sort(rows.views);
  rows.views.erase(std::unique(rows.views.begin(), rows.views.end()), rows.views.end());
  try {
    const SignatureShape shape = to_header(settings()).shape;
    RecordBytes scratch;
    read_available_views(rows.views, [&](const ViewRow& row) { check_row(row, shape, scratch); });
    for (const std::string& name : rows.maps) static_cast<void>(read_map(*this, name));
    for (const std::string& name : rows.routes) check_route(*this, name);
  } catch (const ContractError& error) {
    fail_damaged(std::string("a change that can be undone is not one of panonav: ") + error.what());
  }
}

void SqliteTables::undo() {
  std::int64_t id = 0;
  std::optional<UndoneRows> rows;
  {
    Statement row(database_, select_history);
    rows = step_to_next_change(database_, row);
    if (!rows || row.is_null(3)) fail_damaged("table history");
    id = row.integer(0);
    const auto changes = row.blob(3);
    SqliteBytes inverse;
    void* data = nullptr;
    int code = sqlite3changeset_invert(static_cast<int>(changes.size()), changes.data(),
                                       &inverse.size, &data);
    inverse.data.reset(data);
    std::string conflicting_table;
    if (code == SQLITE_OK) {
      code = sqlite3changeset_apply(database_.handle(), inverse.size, data, nullptr, on_conflict,
                                    &conflicting_table);
    }
    if (code == SQLITE_ABORT) {
      throw_undo_conflict(path_, row.text(1), conflicting_table);
    }
    if (code != SQLITE_OK) database_.fail(code);
  }
  run_statement(database_, "DELETE FROM history WHERE id = ?", id);
  require_intact(std::move(*rows));
}

}  // namespace panonav
