// Taking the last change of an SQLite file back, by the session extension.

#define SQLITE_ENABLE_SESSION
#define SQLITE_ENABLE_PREUPDATE_HOOK
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/memory_schema.hpp"
#include "panonav/storage/internal/sqlite_tables.hpp"

namespace panonav {

namespace {

// Tables whose rows `undo` brings back.
constexpr std::array<const char*, 8> tables{"views",    "thumbnails", "links",        "maps",
                                            "settings", "routes",     "route_blocks", "features"};

struct EndSession {
  void operator()(sqlite3_session* session) const noexcept { sqlite3session_delete(session); }
};

// Bytes that SQLite gave away.
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

// The only row of the table, checked.
bool find_undo(Database& database, Statement& row) {
  if (!row.step()) return false;
  if (row.integer(2) != undo_checksum(row.text(0), row.blob(1))) {
    database.fail_damaged("the change that can be undone does not match its checksum");
  }
  return true;
}

constexpr const char* select_undo = "SELECT what, changes, checksum FROM undo WHERE id = 1";

// Settings are notes on the views, which are checked when they are used: newer ones stay.
int on_conflict(void* in_the_way, int, sqlite3_changeset_iter* change) {
  const char* table = nullptr;
  int columns = 0;
  int operation = 0;
  int indirect = 0;
  sqlite3changeset_op(change, &table, &columns, &operation, &indirect);
  if (std::string_view(table) == "settings") return SQLITE_CHANGESET_OMIT;
  *static_cast<std::string*>(in_the_way) = table;
  return SQLITE_CHANGESET_ABORT;
}

int is_undone(void*, const char* table) {
  return std::ranges::find(tables, std::string_view(table)) != tables.end() ? 1 : 0;
}

}  // namespace

void SqliteTables::keep_for_undo(const std::function<void()>& changes, const std::string& what) {
  const auto check = [&](int code) {
    if (code != SQLITE_OK) database_.fail(code);
  };
  sqlite3_session* started = nullptr;
  check(sqlite3session_create(database_.handle(), "main", &started));
  std::unique_ptr<sqlite3_session, EndSession> session(started);
  for (const char* table : tables) check(sqlite3session_attach(started, table));
  changes();
  SqliteBytes made;
  void* data = nullptr;
  check(sqlite3session_changeset(session.get(), &made.size, &data));
  made.data.reset(data);
  session.reset();
  require_undo_bytes(path_, made.size);
  Statement keep(database_, "REPLACE INTO undo(id, what, changes, checksum) VALUES(1, ?, ?, ?)");
  keep.bind(1, std::string_view(what))
      .bind(2, made.bytes())
      .bind(3, undo_checksum(what, made.bytes()));
  if (keep.run() != 0) fail_damaged("table undo");
}

std::optional<std::string> SqliteTables::undoable() {
  if (!has_undo_table(database_)) return std::nullopt;
  Statement row(database_, select_undo);
  if (!find_undo(database_, row)) return std::nullopt;
  return std::string(row.text(0));
}

void SqliteTables::undo() {
  {
    Statement row(database_, select_undo);
    if (!find_undo(database_, row)) fail_damaged("table undo");
    const auto changes = row.blob(1);
    SqliteBytes inverse;
    void* data = nullptr;
    int code = sqlite3changeset_invert(static_cast<int>(changes.size()), changes.data(),
                                       &inverse.size, &data);
    inverse.data.reset(data);
    std::string in_the_way;
    if (code == SQLITE_OK) {
      code = sqlite3changeset_apply(database_.handle(), inverse.size, data, is_undone, on_conflict,
                                    &in_the_way);
    }
    if (code == SQLITE_ABORT) {
      throw FileError(path_.string(), "cannot undo \"" + std::string(row.text(0)) +
                                          "\": the table " + in_the_way +
                                          " has changed since where it was changed then");
    }
    if (code != SQLITE_OK) database_.fail(code);
  }
  database_.execute("DELETE FROM undo");
}

}  // namespace panonav
