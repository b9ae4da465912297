#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "panonav/storage/internal/database.hpp"
#include "panonav/storage/memory_header.hpp"

namespace panonav {

/// Spells "PNAV"; marks an SQLite file as a memory file.
inline constexpr std::uint32_t memory_application_id = 0x504E4156;
/// The user_version of memory files; files of another version are refused.
inline constexpr int memory_format_version = 1;

/// Checks only the first bytes, so that a file of another program is never opened for writing.
/// Throws FileError if the file is missing, no SQLite file, or of another program or format
/// version.
void require_memory_file(const std::filesystem::path& path);

/// Makes the tables in an empty database; call it within a transaction.
void create_schema(Database& database);
/// Throws FileError unless the file has exactly the tables and indexes of a memory file, each on
/// pages of its own: no view, no trigger, no statistics.
void require_schema(Database& database);

/// Returns all settings. Throws FileError if a row is damaged.
[[nodiscard]] Settings read_settings(Database& database);
/// Sets the value of a key, within the caller's transaction if there is one.
void write_setting(Database& database, const std::string& key, const SettingValue& value);

}  // namespace panonav
