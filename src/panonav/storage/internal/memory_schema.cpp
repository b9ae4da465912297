#include "panonav/storage/internal/memory_schema.hpp"

#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <map>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/write_ahead_log.hpp"

namespace panonav {

namespace {

struct Table {
  std::string_view name;
  const char* sql;  // text as SQLite stores it
};

// Links have a < b. Every checksum is XXH64 over the other fields of its row (docs/formats.md). The
// table `log` is first, so that it is on the second page of every file.
constexpr std::array<Table, 12> tables{{
    {"log",
     "CREATE TABLE log(id INTEGER PRIMARY KEY, before BLOB NOT NULL, now BLOB NOT NULL) STRICT"},
    {"features",
     "CREATE TABLE features(part INTEGER PRIMARY KEY, bytes BLOB NOT NULL, checksum INTEGER) "
     "STRICT"},
    {"history",
     "CREATE TABLE history(id INTEGER PRIMARY KEY, what TEXT NOT NULL, stamp_s REAL NOT NULL, "
     "changes BLOB, checksum INTEGER NOT NULL) STRICT"},
    {"links",
     "CREATE TABLE links(a INTEGER NOT NULL, b INTEGER NOT NULL, kind INTEGER NOT NULL, checksum "
     "INTEGER NOT NULL, PRIMARY KEY(a, b)) STRICT, WITHOUT ROWID"},
    {"settings",
     "CREATE TABLE settings(key TEXT NOT NULL PRIMARY KEY, value ANY NOT NULL, checksum INTEGER "
     "NOT NULL) STRICT, WITHOUT ROWID"},
    {"synchronised",
     "CREATE TABLE synchronised(view INTEGER PRIMARY KEY, server_view INTEGER, local_checksum "
     "INTEGER NOT NULL, server_checksum INTEGER NOT NULL, signature INTEGER NOT NULL, uploaded "
     "INTEGER NOT NULL, sent INTEGER, checksum INTEGER NOT NULL) STRICT"},
    {"synchronised_links",
     "CREATE TABLE synchronised_links(a INTEGER NOT NULL, b INTEGER NOT NULL, kind INTEGER NOT "
     "NULL, checksum INTEGER NOT NULL, PRIMARY KEY(a, b)) STRICT, WITHOUT ROWID"},
    {"thumbnails",
     "CREATE TABLE thumbnails(part INTEGER PRIMARY KEY, bytes BLOB NOT NULL, checksum INTEGER) "
     "STRICT"},
    {"views",
     "CREATE TABLE views(id INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT NOT NULL UNIQUE, x_m "
     "REAL, y_m REAL, heading_rad REAL, stamp_s REAL, signature BLOB NOT NULL, checksum INTEGER "
     "NOT NULL) STRICT"},
    {"maps",
     "CREATE TABLE maps(name TEXT NOT NULL PRIMARY KEY, nodes BLOB NOT NULL, edges BLOB NOT NULL, "
     "checksum INTEGER NOT NULL) STRICT, WITHOUT ROWID"},
    {"route_blocks",
     "CREATE TABLE route_blocks(route TEXT NOT NULL, number INTEGER NOT NULL, lines BLOB NOT NULL, "
     "checksum INTEGER NOT NULL, PRIMARY KEY(route, number)) STRICT, WITHOUT ROWID"},
    {"routes",
     "CREATE TABLE routes(name TEXT NOT NULL PRIMARY KEY, columns INTEGER NOT NULL, lines INTEGER "
     "NOT NULL, checksum INTEGER NOT NULL) STRICT, WITHOUT ROWID"},
}};

// Entries that SQLite adds by itself: the table with the last view id, and the index of the names.
constexpr std::string_view sequence = "CREATE TABLE sqlite_sequence(name,seq)";
constexpr std::string_view names_index = "sqlite_autoindex_views_1";
// Index of the second end of links, so that the links of a view are found from either end.
constexpr const char* links_index = "CREATE INDEX links_b ON links(b)";
// Index of poses, so that places are found and counted without reading signatures.
constexpr const char* poses_index = "CREATE INDEX views_pose ON views(x_m, y_m, heading_rad)";

std::string to_hexadecimal(std::uint32_t value) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "0x%08x", static_cast<unsigned>(value));
  return text.data();
}

SettingValue read_value(const Statement& row, int column) {
  switch (row.type(column)) {
    case SQLITE_INTEGER:
      return row.integer(column);
    case SQLITE_FLOAT:
      return row.real(column);
    case SQLITE_TEXT:
      return std::string(row.text(column));
    default: {
      const auto blob = row.blob(column);
      return std::vector<std::uint8_t>(blob.begin(), blob.end());
    }
  }
}

}  // namespace

void require_memory_file(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    throw FileError(name, "is a folder; allowed: a memory file");
  }
  // The file is read through SQLite, which knows its other connections to it in this process:
  // closing a descriptor of our own would release all locks that they hold.
  if (::access(path.c_str(), R_OK) != 0) {
    throw FileError(name, "cannot be read: " + std::generic_category().message(errno));
  }
  if (!std::filesystem::is_regular_file(path, ignored)) {
    throw FileError(name, "is not a file; allowed: a memory file");
  }
  const Database database(path, DatabaseMode::immutable);
  sqlite3_file* file = nullptr;
  sqlite3_file_control(database.handle(), "main", SQLITE_FCNTL_FILE_POINTER, &file);
  std::array<std::uint8_t, 100> head{};
  const int code = file->pMethods->xRead(file, head.data(), static_cast<int>(head.size()), 0);
  if (code != SQLITE_OK && code != SQLITE_IOERR_SHORT_READ) database.fail(code);
  constexpr std::string_view magic("SQLite format 3\0", 16);
  if (code != SQLITE_OK || std::memcmp(head.data(), magic.data(), magic.size()) != 0) {
    throw FileError(name, "is not a memory file; allowed: memory files that panonav made");
  }
  const std::uint32_t application_id = read_big_endian_word(head.data() + 68);
  if (application_id != memory_application_id) {
    throw FileError(name, "is an SQLite file of another program: application_id is " +
                              to_hexadecimal(application_id) +
                              "; allowed: " + to_hexadecimal(memory_application_id));
  }
  const std::uint32_t version = read_big_endian_word(head.data() + 60);
  if (version != static_cast<std::uint32_t>(memory_format_version)) {
    throw FileError(name, "has format version " + std::to_string(version) +
                              "; allowed: " + std::to_string(memory_format_version));
  }
}

void create_schema(Database& database) {
  database.execute(("PRAGMA application_id=" + std::to_string(memory_application_id)).c_str());
  for (const Table& table : tables) database.execute(table.sql);
  database.execute("INSERT INTO log VALUES(1, zeroblob(16), randomblob(16))");
  database.execute(("PRAGMA user_version=" + std::to_string(memory_format_version)).c_str());
  database.execute(links_index);
  database.execute(poses_index);
}

void require_schema(Database& database) {
  struct Entry {
    std::string_view type, table, sql;
  };
  std::map<std::string_view, Entry> missing{
      {"sqlite_sequence", {"table", "sqlite_sequence", sequence}},
      {names_index, {"index", "views", ""}},
      {"links_b", {"index", "links", links_index}},
      {"views_pose", {"index", "views", poses_index}}};
  for (const Table& table : tables) missing[table.name] = {"table", table.name, table.sql};
  const auto fail = [&](std::string_view type, std::string_view name, const char* what) {
    database.fail_damaged(std::string(type) + " " + std::string(name.substr(0, 60)) + " " + what);
  };
  // An entry is removed from `missing` when it is found, so that a second one of its name is
  // refused.
  Statement rows(database,
                 "SELECT type, name, tbl_name, coalesce(sql, ''), rootpage FROM sqlite_schema");
  std::set<std::int64_t> pages{1};
  while (rows.step()) {
    const auto found = missing.find(rows.text(1));
    if (found == missing.end()) fail(rows.text(0), rows.text(1), "is not a part of a memory");
    const Entry& entry = found->second;
    if (rows.text(0) != entry.type || rows.text(2) != entry.table || rows.text(3) != entry.sql ||
        !pages.insert(rows.integer(4)).second) {
      fail(entry.type, found->first, "is not as it was made");
    }
    missing.erase(found);
  }
  for (const auto& [name, entry] : missing) {
    fail(entry.type, name, "is missing or not as it was made");
  }
}

Settings read_settings(Database& database) {
  Statement check(database, "PRAGMA quick_check(settings)");
  if (!check.step() || check.text(0) != "ok") database.fail_damaged("table settings");
  check.reset();
  Settings settings;
  Statement rows(database, "SELECT key, value, checksum FROM settings ORDER BY key");
  while (rows.step()) {
    std::string key(rows.text(0));
    SettingValue value = read_value(rows, 1);
    if (rows.integer(2) != setting_checksum(key, value)) {
      database.fail_damaged("checksum of setting " + to_readable_line(key));
    }
    settings.emplace(std::move(key), std::move(value));
  }
  return settings;
}

void write_setting(Database& database, const std::string& key, const SettingValue& value) {
  Statement insert(database,
                   "INSERT INTO settings(key, value, checksum) VALUES(?, ?, ?) ON CONFLICT(key) DO "
                   "UPDATE SET value = excluded.value, checksum = excluded.checksum");
  insert.bind(1, key).bind(3, setting_checksum(key, value));
  std::visit([&](const auto& typed) { insert.bind(2, typed); }, value);
  if (insert.run() != 0) throw ContractError("setting " + key, "not a number", "finite numbers");
}

}  // namespace panonav
