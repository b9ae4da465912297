#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "panonav/storage/internal/database.hpp"
#include "panonav/storage/memory_header.hpp"

namespace panonav {

/// "PNAV": marks an SQLite file as a memory file.
inline constexpr std::uint32_t memory_application_id = 0x504E4156;
/// The user_version of files is at most this; a reader refuses files of a larger one. Files of
/// versions 1 to 7 are read as they are and get this version before their first change: 1 had
/// neither maps nor routes, 2 added chains of snapshots, 3 maps, 4 routes, 5 the tables `log` and
/// `undo`, 6 local features, 7 the table `history` instead of `undo`, whose row moves there, 8 the
/// tables of synchronisation with a server.
inline constexpr int memory_format_version = 8;

/// Looks at the first bytes alone, without SQLite, so that nothing that is not ours is ever opened
/// for writing. Throws FileError: missing, no SQLite file, of another program, newer.
void require_memory_file(const std::filesystem::path& path);

[[nodiscard]] int format_version(Database& database);
/// Makes the tables in an empty database. Within the caller's transaction.
void create_schema(Database& database);
/// Adds what a file of an older version lacks. Within the caller's transaction.
void upgrade_schema(Database& database);
[[nodiscard]] bool has_chain_tables(Database& database);
[[nodiscard]] inline bool has_map_table(Database& database) {
  return format_version(database) >= 3;
}
[[nodiscard]] inline bool has_route_tables(Database& database) {
  return format_version(database) >= 4;
}
[[nodiscard]] inline bool has_undo_table(Database& database) {
  return format_version(database) >= 5;
}
[[nodiscard]] inline bool has_feature_table(Database& database) {
  return format_version(database) >= 6;
}
[[nodiscard]] inline bool has_history_table(Database& database) {
  return format_version(database) >= 7;
}
[[nodiscard]] inline bool has_synchronised_tables(Database& database) {
  return format_version(database) >= 8;
}
/// Throws FileError unless tables and indexes are exactly those of the file's version, each on
/// pages of its own, and there is nothing else: no view, no trigger, no statistics.
void require_schema(Database& database);

/// All rows of the table of settings; throws FileError when one is damaged.
[[nodiscard]] Settings read_settings(Database& database);
/// Replaces the value that the key had. Within the caller's transaction, if there is one.
void write_setting(Database& database, const std::string& key, const SettingValue& value);

}  // namespace panonav
