#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "panonav/storage/internal/database.hpp"
#include "panonav/storage/memory_header.hpp"

namespace panonav {

/// "PNAV": marks an SQLite file as a memory file.
inline constexpr std::uint32_t memory_application_id = 0x504E4156;
/// The user_version of files is at most this; a reader refuses files of a larger one. New files
/// have 1; saving the first map adds the table of maps and makes it 3, the first route adds its
/// tables, too, and makes it 4, so that who has none of them can give the file to an older reader.
/// Files of 2 and more have the tables of chains of snapshots, which nothing writes any more: they
/// stay empty in new files, because older readers ask for them.
inline constexpr int memory_format_version = 4;

/// Looks at the first bytes alone, without SQLite, so that nothing that is not ours is ever opened
/// for writing. Throws FileError: missing, no SQLite file, of another program, newer.
void require_memory_file(const std::filesystem::path& path);

/// Makes the tables in an empty database.
void create_schema(Database& database);
[[nodiscard]] bool has_chain_tables(Database& database);
/// Adds the table of maps where the file has none yet. Within the caller's transaction.
void add_map_table(Database& database);
[[nodiscard]] bool has_map_table(Database& database);
/// The same of the tables of routes, which come with that of maps.
void add_route_tables(Database& database);
[[nodiscard]] bool has_route_tables(Database& database);
/// Throws FileError unless the tables are exactly those of the file's version.
void require_schema(Database& database);

/// All rows of the table of settings; throws FileError when one is damaged.
[[nodiscard]] Settings read_settings(Database& database);
/// Replaces the value that the key had. Within the caller's transaction, if there is one.
void write_setting(Database& database, const std::string& key, const SettingValue& value);

}  // namespace panonav
