#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace panonav::recordings {

/// Serialisation of a message.
enum class MessageEncoding {
  ros1,      ///< of ROS 1 bags
  cdr,       ///< of ROS 2, little or big endian (XCDR1)
  protobuf,  ///< of Foxglove; pictures only
  other      ///< not supported by `read_message`
};

/// A topic of a recording: all channels (MCAP) or connections (ROS 1) of one name, type and
/// encoding. A topic whose type changes is listed once for each type.
struct RecordedTopic {
  std::string name;  ///< "/camera/image/compressed"
  /// ROS 1's name of the type, such as "sensor_msgs/CompressedImage", also for ROS 2's
  /// "sensor_msgs/msg/CompressedImage".
  std::string type;
  MessageEncoding encoding = MessageEncoding::other;  ///< serialisation of its messages
  std::uint64_t messages = 0;                         ///< number of messages
  std::string encoding_name;  ///< name of the serialisation in the file, such as "json"
};

/// Position of a message in its recording.
struct MessageLocation {
  std::int64_t time_ns = 0;  ///< time of recording (log time)
  std::uint32_t topic = 0;   ///< index into `Recording::topics()`
  std::uint32_t file = 0;    ///< this and the next two are internal
  std::uint64_t block = 0;   ///< number of the chunk in its file, or 0
  std::uint64_t offset = 0;  ///< of the message within the chunk, or its row id
  friend bool operator==(const MessageLocation&, const MessageLocation&) = default;
};

/// A span of time, both ends included.
struct TimeSpan {
  std::int64_t begin_ns = 0;  ///< nanoseconds, on the recording's clock
  std::int64_t end_ns = 0;    ///< the same, >= `begin_ns`
  friend bool operator==(const TimeSpan&, const TimeSpan&) = default;
};

/// Limits for reading a file. Memory: a reader holds one list of locations (32 bytes for each
/// message), one chunk, packed and unpacked, and up to 16 MiB of other chunks.
struct RecordingLimits {
  std::size_t chunk_bytes = 256U << 20U;  ///< of an unpacked chunk or message, <= 4 GiB
  std::size_t messages = 50'000'000;      ///< number of messages listed at a time
  /// Unpacked size of a compressed file (.zstd), and never more than half of the free space in the
  /// folder for temporary files (TMPDIR).
  std::uint64_t file_bytes = std::uint64_t{32} << 30U;
};

/// Messages of topics, with the times at which they were recorded. Formats: an MCAP file, a ROS 1
/// bag (version 2.0), a .db3 file of rosbag2, or a folder of rosbag2 with one or several files; a
/// folder without metadata.yaml, of a recorder that crashed, gives a warning. Compressed files
/// (.zstd) are unpacked into a temporary file.
///
/// A file that is cut off or damaged is read up to the damage, and chunks with a wrong checksum are
/// skipped; `warnings` reports both.
class Recording {
 public:
  /// Opens a recording; its first bytes, not its name, decide its format. Throws FileError if the
  /// file is missing, has another format or version, or nothing of it can be read. Cost: reading
  /// the index of the file, or the whole file if it has none.
  [[nodiscard]] static std::unique_ptr<const Recording> open(const std::filesystem::path& path,
                                                             const RecordingLimits& limits = {});

  virtual ~Recording() = default;

  /// Returns the topics in the order of their first appearance.
  [[nodiscard]] virtual const std::vector<RecordedTopic>& topics() const noexcept = 0;
  /// Returns the times of the first and the last message; nullopt without messages.
  [[nodiscard]] virtual std::optional<TimeSpan> time() const noexcept = 0;
  /// Returns warnings about damaged or skipped parts, one line each. Later reading can add more.
  [[nodiscard]] virtual std::vector<std::string> warnings() const = 0;

  /// Returns the locations of the messages of these topics within the time span, sorted by time,
  /// and at equal times by file. Throws FileError if there are more than the limit, ContractError
  /// on an unknown topic. Chunks outside of the span are not read.
  [[nodiscard]] virtual std::vector<MessageLocation> locations(
      std::span<const std::uint32_t> topics, std::optional<TimeSpan> within = {}) const = 0;

  /// Returns the bytes of a message. Several threads may call at a time. Reading in the order of
  /// `locations` is fastest. Throws FileError if the chunk of the message is damaged.
  [[nodiscard]] virtual std::vector<std::uint8_t> read(const MessageLocation& location) const = 0;

  /// Passes the messages that `locations` would list to `use`, in the same order. Bytes are valid
  /// until `use` returns. Damaged chunks are skipped with a warning. Memory: it lists only the
  /// messages of chunks that overlap in time, not all.
  virtual void for_each(
      std::span<const std::uint32_t> topics, std::optional<TimeSpan> within,
      const std::function<void(const MessageLocation& location,
                               std::span<const std::uint8_t> bytes)>& use) const = 0;
};

/// True if `Recording::open` would accept the path, by the first bytes of a file, the metadata.yaml
/// of a folder, or the files of a folder without pictures. Never throws; false if it cannot be
/// read.
[[nodiscard]] bool is_recording(const std::filesystem::path& path) noexcept;

}  // namespace panonav::recordings
