#pragma once

#include <cstdint>
#include <filesystem>

namespace panonav {

/// Throws FileError if there is a log next to the file that is not its own but would change it.
/// SQLite applies any log of the right name, even one that a killed writer left next to a file
/// which was later replaced by a backup. It changes nothing.
///
/// Every change puts a new random mark into the row of the table `log`, and keeps the previous one.
/// A log is the file's own if the file's mark is the one before the log's first change or that of
/// one of its changes (which are in the file already), and only then. Cost: one pass over the log.
void require_own_log(const std::filesystem::path& file);

/// Reads four bytes of an SQLite file as a number, with the most significant byte first.
inline std::uint32_t read_big_endian_word(const std::uint8_t* from) {
  return (std::uint32_t{from[0]} << 24U) | (std::uint32_t{from[1]} << 16U) |
         (std::uint32_t{from[2]} << 8U) | from[3];
}

}  // namespace panonav
