#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace panonav::recordings {

/// Compression of a chunk; LZ4 and Zstandard data is in their frame formats.
enum class Packing { none, lz4, zstd, bz2 };

/// Finds the compression by its name in recordings: "" or "none", "lz4", "zstd", "bz2".
[[nodiscard]] std::optional<Packing> parse_packing(std::string_view name) noexcept;

/// A buffer that is not zeroed, so that the system provides memory only for the filled part.
struct Buffer {
  Buffer() = default;
  explicit Buffer(std::size_t bytes)
      : data(std::make_unique_for_overwrite<std::uint8_t[]>(bytes)), size(bytes) {}
  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept { return {data.get(), size}; }
  std::unique_ptr<std::uint8_t[]> data;
  std::size_t size = 0;
};

/// Result of `unpack`, which produces at most `max_bytes` bytes and stops there. `is_whole` is true
/// if these are all bytes of a complete stream; otherwise `content` ends at the damage, at the end
/// of `packed` or at `max_bytes`.
struct Unpacked {
  Buffer content;
  bool is_whole = false;
};
[[nodiscard]] Unpacked unpack(std::span<const std::uint8_t> packed, Packing packing,
                              std::size_t max_bytes);

/// Unpacks a Zstandard frame of unknown size, to at most `max_bytes` bytes.
[[nodiscard]] Unpacked unpack_zstd_frame(std::span<const std::uint8_t> packed,
                                         std::size_t max_bytes);

/// Result of `unpack_zstd_file`, which unpacks the Zstandard frames of a file to another file, at
/// most `max_bytes` bytes. Memory: two buffers of 128 KiB and the window of a frame, at most 128
/// MiB.
struct UnpackedFile {
  std::uint64_t bytes = 0;     ///< written to the other file
  bool is_whole = false;       ///< false: damaged or cut off after these bytes
  bool exceeds_limit = false;  ///< the content is larger than `max_bytes`
};
[[nodiscard]] UnpackedFile unpack_zstd_file(const std::filesystem::path& packed,
                                            const std::filesystem::path& to,
                                            std::uint64_t max_bytes);

/// Replaces the content of `packed` by one LZ4 or Zstandard frame of the bytes, at the fastest
/// level.
void pack(std::span<const std::uint8_t> bytes, Packing packing, std::vector<std::uint8_t>& packed);

}  // namespace panonav::recordings
