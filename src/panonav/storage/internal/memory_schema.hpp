#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "panonav/storage/internal/database.hpp"
#include "panonav/storage/memory_header.hpp"

namespace panonav {

/// "PNAV": marks an SQLite file as a memory file.
inline constexpr std::uint32_t memory_application_id = 0x504E4156;
/// The user_version of files. A file of another version is refused.
inline constexpr int memory_format_version = 1;

/// Looks at the first bytes alone, so that nothing that is not ours is ever opened for writing.
/// Throws FileError: missing, no SQLite file, of another program, of another format version.
void require_memory_file(const std::filesystem::path& path);

/// Makes the tables in an empty database. Within the caller's transaction.
void create_schema(Database& database);
/// Throws FileError unless tables and indexes are exactly those of a memory file, each on pages of
/// its own, and there is nothing else: no view, no trigger, no statistics.
void require_schema(Database& database);

/// All rows of the table of settings; throws FileError when one is damaged.
[[nodiscard]] Settings read_settings(Database& database);
/// Replaces the value that the key had. Within the caller's transaction, if there is one.
void write_setting(Database& database, const std::string& key, const SettingValue& value);

}  // namespace panonav
