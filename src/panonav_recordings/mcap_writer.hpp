#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace panonav::recordings {

/// Compression of chunks.
enum class McapCompression {
  none,  ///< stored without compression
  lz4,   ///< fast, larger
  zstd   ///< slower, smaller
};

/// Options for writing an MCAP file.
struct McapWriterOptions {
  McapCompression compression = McapCompression::zstd;  ///< of each chunk
  std::size_t chunk_bytes = 1U << 20U;  ///< a chunk ends with the message that reaches this
  std::string profile = "ros2";         ///< of the file's header; empty: none
};

/// Writes an MCAP file (https://mcap.dev/spec, version 0) with all that readers can use:
/// chunks with checksums, indexes of messages and chunks, statistics.
///
/// The file is only ever appended to: readers of a file whose writer was killed get all complete
/// chunks, and `path` can be a pipe. An existing file is replaced. All functions throw FileError if
/// the file cannot be written; earlier parts stay readable, and later calls throw, too. Only one
/// thread may use it at a time.
class McapWriter {
 public:
  /// Creates the file, or empties an existing one, and writes the header.
  explicit McapWriter(const std::filesystem::path& path, const McapWriterOptions& options = {});
  ~McapWriter();  ///< Finishes the file as `close` does, and ignores failures.
  /// A moved-from object may only be destroyed or assigned to.
  McapWriter(McapWriter&&) noexcept;
  McapWriter& operator=(McapWriter&&) noexcept;

  /// Adds a message definition: `name` such as "sensor_msgs/msg/Imu", `data` its text in the format
  /// `encoding`, such as "ros2msg". Returns its number, from 1 on; at most 65535.
  std::uint16_t add_schema(std::string_view name, std::string_view encoding, std::string_view data);
  /// Adds a topic whose messages are encoded as `message_encoding`, such as "cdr". `schema` is the
  /// number of its definition; 0: none. Returns its number, from 0 on. At most 65535.
  std::uint16_t add_channel(std::string_view topic, std::string_view message_encoding,
                            std::uint16_t schema);
  /// Appends a message to the chunk in memory, which is written once it has `chunk_bytes`. Times
  /// are >= 0. Throws ContractError on an unknown channel. Cost: a copy of the bytes, and
  /// compressing them.
  void write(std::uint16_t channel, std::int64_t log_time_ns, std::int64_t publish_time_ns,
             std::span<const std::uint8_t> message);
  /// Writes the messages in memory as a chunk now, so that a reader of the unfinished file finds
  /// them.
  void flush();
  /// Writes the last chunk, summary and footer, and waits until they are on the disk. Nothing more
  /// can be written afterwards. Closing twice does nothing.
  void close();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace panonav::recordings
