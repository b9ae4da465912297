// Several changes as one, and taking the last one back.

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
#include "panonav/storage/internal/memory_file_implementation.hpp"
#include "panonav/storage/internal/memory_schema.hpp"

namespace panonav {

namespace {

constexpr int max_undo_bytes = 200 << 20;  // SQLite takes fields of 256 MiB

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

std::int64_t undo_checksum(std::string_view what, std::span<const std::uint8_t> changes) {
  RecordBytes record;
  record.add(what);
  return static_cast<std::int64_t>(checksum(changes, checksum(record.bytes())));
}

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

void MemoryFile::change(const std::function<void()>& changes,
                        const std::optional<std::string>& undo) {
  Database& database = implementation_->database;
  std::unique_ptr<sqlite3_session, EndSession> session;
  const auto check = [&](int code) {
    if (code != SQLITE_OK) database.fail(code);
  };
  Transaction transaction(database, Transaction::Kind::writing);
  if (undo) {
    sqlite3_session* started = nullptr;
    check(sqlite3session_create(database.handle(), "main", &started));
    session.reset(started);
    for (const char* table : tables) check(sqlite3session_attach(started, table));
  }
  changes();
  if (undo) {
    SqliteBytes made;
    void* data = nullptr;
    check(sqlite3session_changeset(session.get(), &made.size, &data));
    made.data.reset(data);
    session.reset();
    if (made.size > max_undo_bytes) {
      throw FileError(path().string(), "would keep " + std::to_string(made.size) +
                                           " bytes to undo this; allowed: up to " +
                                           std::to_string(max_undo_bytes) +
                                           ", or not to keep them");
    }
    Statement keep(database, "REPLACE INTO undo(id, what, changes, checksum) VALUES(1, ?, ?, ?)");
    keep.bind(1, std::string_view(*undo))
        .bind(2, made.bytes())
        .bind(3, undo_checksum(*undo, made.bytes()));
    if (keep.run() != 0) database.fail_damaged("table undo");
  }
  transaction.commit();
}

std::optional<std::string> MemoryFile::undoable() const {
  Database& database = implementation_->database;
  if (!has_undo_table(database)) return std::nullopt;
  Statement row(database, select_undo);
  if (!find_undo(database, row)) return std::nullopt;
  return std::string(row.text(0));
}

void MemoryFile::undo() {
  Database& database = implementation_->database;
  Transaction transaction(database, Transaction::Kind::writing);
  {
    Statement row(database, select_undo);
    if (!find_undo(database, row)) {
      throw ContractError("undo", "not possible", "after a change that was kept for it");
    }
    const auto changes = row.blob(1);
    SqliteBytes inverse;
    void* data = nullptr;
    int code = sqlite3changeset_invert(static_cast<int>(changes.size()), changes.data(),
                                       &inverse.size, &data);
    inverse.data.reset(data);
    std::string in_the_way;
    if (code == SQLITE_OK) {
      code = sqlite3changeset_apply(database.handle(), inverse.size, data, is_undone, on_conflict,
                                    &in_the_way);
    }
    if (code == SQLITE_ABORT) {
      throw FileError(path().string(), "cannot undo \"" + std::string(row.text(0)) +
                                           "\": the table " + in_the_way +
                                           " has changed since where it was changed then");
    }
    if (code != SQLITE_OK) database.fail(code);
  }
  database.execute("DELETE FROM undo");
  transaction.commit();
}

}  // namespace panonav
