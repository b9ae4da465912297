#pragma once

#include <cstdint>
#include <filesystem>

namespace panonav {

/// Throws FileError when a log next to the file would change it and is not its own: SQLite applies
/// any log of the right name, even one that a killed writer left next to a file that was then
/// replaced by a backup. Changes nothing.
///
/// Every change gives the row of the table `log` a new random mark and keeps the one before. A log
/// is the file's own if and only if the file's mark is the one before the log's first change, or
/// that of one of its changes: these are in the file already. Cost: one pass over the log.
void require_own_log(const std::filesystem::path& file);

/// Reads four bytes of a file of SQLite as a number, the most significant byte first.
inline std::uint32_t read_big_endian_word(const std::uint8_t* from) {
  return (std::uint32_t{from[0]} << 24U) | (std::uint32_t{from[1]} << 16U) |
         (std::uint32_t{from[2]} << 8U) | from[3];
}

}  // namespace panonav
