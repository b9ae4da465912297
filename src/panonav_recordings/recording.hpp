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
  ros1,  ///< of ROS 1 bags
  cdr,   ///< of ROS 2, little or big endian (XCDR1)
  other  ///< not supported by `read_message`
};

/// A topic of a recording: all channels (MCAP) or connections (ROS 1) of one name, type and
/// encoding. A topic that changes its type is two.
struct RecordedTopic {
  std::string name;  ///< "/camera/image/compressed"
  /// "sensor_msgs/CompressedImage"; ROS 2's "sensor_msgs/msg/CompressedImage" has the same name
  /// here.
  std::string type;
  MessageEncoding encoding = MessageEncoding::other;  ///< serialisation of its messages
  std::uint64_t messages = 0;                         ///< number of messages
};

/// Position of a message in its recording.
struct MessageLocation {
  std::int64_t time_ns = 0;  ///< time of recording (log time)
  std::uint32_t topic = 0;   ///< index into `Recording::topics()`
  std::uint32_t file = 0;    ///< these three are internal to the recording
  std::uint64_t block = 0;   ///< number of a chunk in its file; 0 without chunks
  std::uint64_t offset = 0;  ///< of the message within it, or its row
  friend bool operator==(const MessageLocation&, const MessageLocation&) = default;
};

/// A span of time, both ends included.
struct TimeSpan {
  std::int64_t begin_ns = 0;  ///< nanoseconds, on the recording's clock
  std::int64_t end_ns = 0;    ///< the same, >= `begin_ns`
  friend bool operator==(const TimeSpan&, const TimeSpan&) = default;
};

/// Limits for reading a file. Apart from one list of places (32 bytes a message) a reader keeps one
/// chunk, packed and unpacked, and up to 16 MiB of others.
struct RecordingLimits {
  std::size_t chunk_bytes = 256U << 20U;  ///< of a chunk or message unpacked; at most 4 GiB
  std::size_t messages = 50'000'000;      ///< number of messages listed at a time
  /// Unpacked size of a file that is packed as a whole; never more than half of the free space of
  /// the folder for temporary files (TMPDIR).
  std::uint64_t file_bytes = std::uint64_t{32} << 30U;
};

/// Messages of topics with the times at which they were recorded: an MCAP file, a ROS 1 bag
/// (version 2.0), a .db3 file of rosbag2, or a folder of rosbag2 with one or several files. Files
/// that are packed as a whole (.zstd) are unpacked into a temporary file.
///
/// A file that was cut off or damaged gives what comes before the damage, and chunks whose checksum
/// is wrong are left out; `warnings` says so.
class Recording {
 public:
  /// Opens a recording, whose kind is found by its first bytes, not by its name. Throws FileError
  /// when the file is missing, of another kind or version, or nothing in it can be read. Cost: that
  /// of the file's index; without one, one pass over the file.
  [[nodiscard]] static std::unique_ptr<const Recording> open(const std::filesystem::path& path,
                                                             const RecordingLimits& limits = {});

  virtual ~Recording() = default;

  /// Returns the topics in the order of their first appearance.
  [[nodiscard]] virtual const std::vector<RecordedTopic>& topics() const noexcept = 0;
  /// Returns the times of the first and the last message; nullopt without messages.
  [[nodiscard]] virtual std::optional<TimeSpan> time() const noexcept = 0;
  /// Returns warnings about damaged or skipped parts, one line each. Reading can add more.
  [[nodiscard]] virtual std::vector<std::string> warnings() const = 0;

  /// Returns the places of the messages of these topics within the span, by time; of one time, in
  /// the order of the files. Throws FileError when there are more than the limit, ContractError on
  /// an unknown topic. Chunks outside of the span are not read.
  [[nodiscard]] virtual std::vector<MessageLocation> places(
      std::span<const std::uint32_t> topics, std::optional<TimeSpan> within = {}) const = 0;

  /// Returns the bytes of a message. Several threads may call at a time; fastest in the order of
  /// `places`. Throws FileError when the message is in a damaged chunk.
  [[nodiscard]] virtual std::vector<std::uint8_t> read(const MessageLocation& place) const = 0;

  /// Passes the messages that `places` would list to `use`, in that order. Bytes are valid until
  /// `use` returns. Damaged chunks are left out, with a warning. Needs no list of all messages:
  /// only of those chunks that overlap in time.
  virtual void for_each(
      std::span<const std::uint32_t> topics, std::optional<TimeSpan> within,
      const std::function<void(const MessageLocation& place, std::span<const std::uint8_t> bytes)>&
          use) const = 0;
};

/// True if `Recording::open` would accept it: checks the first bytes of a file, or the
/// metadata.yaml of a folder. Never throws; false for what cannot be read.
[[nodiscard]] bool is_recording(const std::filesystem::path& path) noexcept;

}  // namespace panonav::recordings
