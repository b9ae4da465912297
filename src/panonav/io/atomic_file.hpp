#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace panonav {

/// Writes a file completely or not at all: the bytes go to a temporary file in the same folder,
/// which is renamed to `path` once all bytes are on the disk. An existing file is replaced; a
/// symbolic link stays, and the file that it points to is replaced. Something that is not a regular
/// file (a pipe, /dev/stdout) is written to directly. Throws FileError; an existing file at `path`
/// is then unchanged.
void write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);
/// Writes the bytes of a text, without adding an end of line.
void write_file(const std::filesystem::path& path, std::string_view text);

/// Reads all bytes of a file. Throws FileError when it cannot be read or is larger than
/// `limit_bytes`.
[[nodiscard]] std::vector<std::uint8_t> read_file(const std::filesystem::path& path,
                                                  std::size_t limit_bytes);

}  // namespace panonav
