#include "panonav/storage/internal/memory_schema.hpp"

#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <system_error>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/checksum.hpp"

namespace panonav {

namespace {

// Names and texts as SQLite keeps them. Links have a < b. Every checksum is XXH64 over the other
// fields of its row (docs/formats.md).
constexpr std::array<std::pair<const char*, const char*>, 4> tables{{
    {"links",
     "CREATE TABLE links(a INTEGER NOT NULL, b INTEGER NOT NULL, kind INTEGER NOT NULL, checksum "
     "INTEGER NOT NULL, PRIMARY KEY(a, b)) STRICT, WITHOUT ROWID"},
    {"settings",
     "CREATE TABLE settings(key TEXT NOT NULL PRIMARY KEY, value ANY NOT NULL, checksum INTEGER "
     "NOT "
     "NULL) STRICT, WITHOUT ROWID"},
    {"thumbnails",
     "CREATE TABLE thumbnails(view INTEGER PRIMARY KEY, picture BLOB NOT NULL, checksum INTEGER "
     "NOT "
     "NULL) STRICT"},
    {"views",
     "CREATE TABLE views(id INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT NOT NULL UNIQUE, x_m "
     "REAL, "
     "y_m REAL, heading_rad REAL, stamp_s REAL, signature BLOB NOT NULL, checksum INTEGER NOT "
     "NULL) "
     "STRICT"},
}};

// Of version 2; sorted by name they come before the others. Nothing but older programs writes them.
constexpr std::array<std::pair<const char*, const char*>, 2> chain_tables{{
    {"chain_snapshots",
     "CREATE TABLE chain_snapshots(chain TEXT NOT NULL, number INTEGER NOT NULL, travelled_m REAL "
     "NOT NULL, x_m REAL NOT NULL, y_m REAL NOT NULL, heading_rad REAL NOT NULL, coefficients BLOB "
     "NOT NULL, checksum INTEGER NOT NULL, PRIMARY KEY(chain, number)) STRICT, WITHOUT ROWID"},
    {"chains",
     "CREATE TABLE chains(name TEXT NOT NULL PRIMARY KEY, rows INTEGER NOT NULL, components "
     "INTEGER "
     "NOT NULL, elevation_bottom_rad REAL, elevation_top_rad REAL, snapshots INTEGER NOT NULL, "
     "checksum INTEGER NOT NULL) STRICT, WITHOUT ROWID"},
}};
// Of version 3; sorted by name it comes after the links.
constexpr const char* map_table_name = "maps";
constexpr const char* map_table =
    "CREATE TABLE maps(name TEXT NOT NULL PRIMARY KEY, nodes BLOB NOT NULL, edges BLOB NOT NULL, "
    "checksum INTEGER NOT NULL) STRICT, WITHOUT ROWID";
// Of version 4; they come after the maps.
constexpr std::array<std::pair<const char*, const char*>, 2> route_tables{{
    {"route_blocks",
     "CREATE TABLE route_blocks(route TEXT NOT NULL, number INTEGER NOT NULL, lines BLOB NOT NULL, "
     "checksum INTEGER NOT NULL, PRIMARY KEY(route, number)) STRICT, WITHOUT ROWID"},
    {"routes",
     "CREATE TABLE routes(name TEXT NOT NULL PRIMARY KEY, columns INTEGER NOT NULL, lines INTEGER "
     "NOT NULL, checksum INTEGER NOT NULL) STRICT, WITHOUT ROWID"},
}};
constexpr int first_version = 1;
constexpr int version_with_chains = 2;
constexpr int version_with_maps = 3;
constexpr int version_with_routes = 4;

// The second end of a link, so that a view's links are found from either.
constexpr const char* links_index = "CREATE INDEX links_b ON links(b)";

std::uint32_t big_endian(const std::uint8_t* from) {
  return (std::uint32_t{from[0]} << 24U) | (std::uint32_t{from[1]} << 16U) |
         (std::uint32_t{from[2]} << 8U) | from[3];
}

std::string hexadecimal(std::uint32_t value) {
  constexpr char digits[] = "0123456789abcdef";
  std::string text = "0x";
  for (int shift = 28; shift >= 0; shift -= 4) text += digits[(value >> shift) & 15U];
  return text;
}

std::int64_t setting_checksum(std::string_view key, const SettingValue& value) {
  RecordBytes record;
  record.add(key);
  std::visit(
      [&](const auto& v) {
        using Value = std::remove_cvref_t<decltype(v)>;
        if constexpr (std::is_same_v<Value, std::string>) {
          record.add(std::string_view(v));
        } else if constexpr (std::is_same_v<Value, std::vector<std::uint8_t>>) {
          record.add(std::span<const std::uint8_t>(v));
        } else {
          record.add(v);
        }
      },
      value);
  return static_cast<std::int64_t>(checksum(record.bytes()));
}

SettingValue value_in(const Statement& row, int column) {
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
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    throw FileError(name, "cannot be read: " + std::generic_category().message(errno));
  }
  std::array<std::uint8_t, 100> head{};
  std::size_t filled = 0;
  ssize_t got = 1;
  while (filled < head.size() && got > 0) {
    got = ::read(descriptor, head.data() + filled, head.size() - filled);
    if (got > 0) filled += static_cast<std::size_t>(got);
  }
  const int read_error = got < 0 ? errno : 0;
  ::close(descriptor);
  if (read_error != 0) {
    throw FileError(name, "cannot be read: " + std::generic_category().message(read_error));
  }
  constexpr std::string_view magic("SQLite format 3\0", 16);
  if (filled < head.size() || std::memcmp(head.data(), magic.data(), magic.size()) != 0) {
    throw FileError(name, "is no memory file; allowed: files that panonav memorise made");
  }
  const std::uint32_t application_id = big_endian(head.data() + 68);
  if (application_id != memory_application_id) {
    throw FileError(name, "is an SQLite file of another program: application_id is " +
                              hexadecimal(application_id) +
                              "; allowed: " + hexadecimal(memory_application_id));
  }
  const std::uint32_t version = big_endian(head.data() + 60);
  if (version > static_cast<std::uint32_t>(memory_format_version)) {
    throw FileError(name, "was made by a newer version: format version is " +
                              std::to_string(version) + "; allowed: 1 .. " +
                              std::to_string(memory_format_version));
  }
  if (version == 0)
    throw FileError(name, "is damaged: format version is 0; allowed: 1 .. " +
                              std::to_string(memory_format_version));
}

void create_schema(Database& database) {
  database.execute(("PRAGMA application_id=" + std::to_string(memory_application_id)).c_str());
  database.execute(("PRAGMA user_version=" + std::to_string(first_version)).c_str());
  for (const auto& [name, text] : tables) database.execute(text);
  database.execute(links_index);
}

bool has_chain_tables(Database& database) {
  return database.integer("PRAGMA user_version") >= version_with_chains;
}

bool has_map_table(Database& database) {
  return database.integer("PRAGMA user_version") >= version_with_maps;
}

void add_map_table(Database& database) {
  if (has_map_table(database)) return;
  if (!has_chain_tables(database)) {
    for (const auto& [name, text] : chain_tables) database.execute(text);
  }
  database.execute(map_table);
  database.execute(("PRAGMA user_version=" + std::to_string(version_with_maps)).c_str());
}

bool has_route_tables(Database& database) {
  return database.integer("PRAGMA user_version") >= version_with_routes;
}

void add_route_tables(Database& database) {
  if (has_route_tables(database)) return;
  add_map_table(database);
  for (const auto& [name, text] : route_tables) database.execute(text);
  database.execute(("PRAGMA user_version=" + std::to_string(version_with_routes)).c_str());
}

void require_schema(Database& database) {
  Statement rows(database,
                 "SELECT type, name, sql FROM sqlite_schema WHERE name NOT LIKE 'sqlite\\_%' "
                 "ESCAPE '\\' ORDER BY type <> 'table', name");
  const auto require_table = [&](std::string_view name, std::string_view text) {
    if (!rows.step() || rows.text(0) != "table" || rows.text(1) != name || rows.text(2) != text) {
      database.fail_damaged("table " + std::string(name) + " is missing or not as it was made");
    }
  };
  if (has_chain_tables(database)) {
    for (const auto& [name, text] : chain_tables) require_table(name, text);
  }
  const bool maps = has_map_table(database);
  const bool routes = has_route_tables(database);
  for (const auto& [name, text] : tables) {
    if (std::string_view(name) == "settings") {
      if (maps) require_table(map_table_name, map_table);
      if (routes) {
        for (const auto& [route_name, route_text] : route_tables) {
          require_table(route_name, route_text);
        }
      }
    }
    require_table(name, text);
  }
  if (!rows.step() || rows.text(1) != "links_b" || rows.text(2) != links_index || rows.step()) {
    database.fail_damaged("the tables are not as they were made");
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
    SettingValue value = value_in(rows, 1);
    if (rows.integer(2) != setting_checksum(key, value)) {
      database.fail_damaged("checksum of setting " + key);
    }
    settings.emplace(std::move(key), std::move(value));
  }
  return settings;
}

void write_setting(Database& database, const std::string& key, const SettingValue& value) {
  Statement insert(database,
                   "INSERT INTO settings(key, value, checksum) VALUES(?, ?, ?) ON CONFLICT(key) DO "
                   "UPDATE SET value = excluded.value, checksum = excluded.checksum");
  insert.bind(1, std::string_view(key)).bind(3, setting_checksum(key, value));
  std::visit(
      [&](const auto& v) {
        using Value = std::remove_cvref_t<decltype(v)>;
        if constexpr (std::is_same_v<Value, std::string>) {
          insert.bind(2, std::string_view(v));
        } else if constexpr (std::is_same_v<Value, std::vector<std::uint8_t>>) {
          insert.bind(2, std::span<const std::uint8_t>(v));
        } else {
          insert.bind(2, v);
        }
      },
      value);
  if (insert.run() != 0) throw ContractError("setting " + key, "not a number", "finite numbers");
}

}  // namespace panonav
