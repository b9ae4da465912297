#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace panonav {

/// Writes a file that appears whole or not at all: the bytes go to a temporary file in the same
/// folder, which takes the name `path` only when every byte is on the disk. An existing file is
/// replaced, a symbolic link keeps pointing at the file that is replaced. Something that is not a
/// regular file (a pipe, /dev/stdout) is written to directly. Throws FileError; whatever was at
/// `path` is then still there.
void write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);
/// Writes the bytes of a text; no line end is added.
void write_file(const std::filesystem::path& path, std::string_view text);

/// All bytes of a file. Throws FileError when it cannot be read or is larger than `limit_bytes`.
[[nodiscard]] std::vector<std::uint8_t> read_file(const std::filesystem::path& path,
                                                  std::size_t limit_bytes);

}  // namespace panonav
