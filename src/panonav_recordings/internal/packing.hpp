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

/// Compression of the bytes of a chunk; LZ4 and Zstandard as frames.
enum class Packing { none, lz4, zstd, bz2 };

/// Finds the compression by its name in recordings: "" or "none", "lz4", "zstd", "bz2".
[[nodiscard]] std::optional<Packing> find_packing(std::string_view name) noexcept;

/// A buffer that is not cleared, so that memory is used only as it is filled.
struct Buffer {
  Buffer() = default;
  explicit Buffer(std::size_t bytes)
      : data(std::make_unique_for_overwrite<std::uint8_t[]>(bytes)), size(bytes) {}
  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept { return {data.get(), size}; }
  std::unique_ptr<std::uint8_t[]> data;
  std::size_t size = 0;
};

/// Unpacks `packed` to at most `max_bytes` bytes, and never more work than for one byte beyond
/// them. `whole`: that was all of a complete stream. Else what came before the damage, the end of
/// `packed`, or `max_bytes`.
struct Unpacked {
  Buffer content;
  bool whole = false;
};
[[nodiscard]] Unpacked unpack(std::span<const std::uint8_t> packed, Packing packing,
                              std::size_t max_bytes);

/// A Zstandard frame of a size that is not known, of at most `max_bytes` bytes.
[[nodiscard]] Unpacked unpack_frame(std::span<const std::uint8_t> packed, std::size_t max_bytes);

/// Unpacks the Zstandard frames of a file to another file, at most `max_bytes` bytes. Memory: two
/// buffers of 128 KiB and the frames' window, at most 128 MiB.
struct UnpackedFile {
  std::uint64_t bytes = 0;  ///< written
  bool whole = false;       ///< else the packed file is damaged or cut off behind them
  bool too_long = false;    ///< more than `max_bytes`
};
[[nodiscard]] UnpackedFile unpack_file(const std::filesystem::path& packed,
                                       const std::filesystem::path& to, std::uint64_t max_bytes);

/// Replaces `packed` by one LZ4 or Zstandard frame of the bytes, at the speed of a recorder.
void pack(std::span<const std::uint8_t> bytes, Packing packing, std::vector<std::uint8_t>& packed);

}  // namespace panonav::recordings
