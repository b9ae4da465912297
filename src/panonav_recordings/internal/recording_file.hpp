#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav_recordings/internal/packing.hpp"
#include "panonav_recordings/recording.hpp"

namespace panonav::recordings {

/// A message and the buffer that holds its bytes.
struct RecordedMessage {
  std::int64_t time_ns = 0;
  std::uint32_t topic = 0;
  std::span<const std::uint8_t> bytes;
  std::shared_ptr<const Buffer> owner;
};

/// One file of a recording. Topic numbers are those of the file. All const functions may be called
/// from several threads.
class RecordingFile {
 public:
  virtual ~RecordingFile() = default;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  [[nodiscard]] const std::vector<RecordedTopic>& topics() const noexcept { return topics_; }
  [[nodiscard]] std::vector<std::string> warnings() const;
  /// Returns the span of the messages' times of each block; nullopt for a block without messages.
  [[nodiscard]] virtual std::vector<std::optional<TimeSpan>> blocks() const = 0;
  /// Appends the locations of the messages of a block that have a chosen topic and a time within
  /// the span, in any order. Throws FileError if `locations` then has more than `max_locations`
  /// elements.
  virtual void list(std::size_t block, const std::vector<bool>& chosen_topics,
                    const TimeSpan& within, std::size_t max_locations,
                    std::vector<MessageLocation>& locations) const = 0;
  /// Throws FileError on damage.
  [[nodiscard]] virtual RecordedMessage read(const MessageLocation& location) const = 0;
  /// Adds the line "PATH: what" to the warnings, unless it is there already.
  void warn(std::string_view what) const;
  void warn(const FileError& error) const;
  /// Sets the path that messages name, for a file that is an unpacked copy of `name`.
  void set_reported_path(const std::filesystem::path& name);

 protected:
  explicit RecordingFile(std::filesystem::path path) : path_(std::move(path)) {}
  /// Returns the number of the topic of this name, type and encoding; adds it if there is none.
  std::uint32_t get_or_create_topic(std::string_view name, std::string_view type,
                                    std::string_view encoding);
  void forget_topics() noexcept;
  /// Throws FileError if there are more messages to list than allowed.
  void check_message_limit(std::size_t locations, std::size_t max_locations) const;
  [[noreturn]] void fail(std::string_view what) const;

  std::vector<RecordedTopic> topics_;

 private:
  std::filesystem::path path_;
  std::unordered_map<std::string, std::uint32_t> topic_numbers_;
  mutable std::mutex warnings_mutex_;
  mutable std::vector<std::string> warnings_;
  mutable std::size_t suppressed_warnings_ = 0;
};

/// Reads little-endian fields one after the other. A field beyond the end reads as 0 or empty, and
/// `good` is false from then on.
class Fields {
 public:
  explicit Fields(std::span<const std::uint8_t> bytes) : left_(bytes) {}
  template <class Number>
  Number number() noexcept {
    const auto from = bytes(sizeof(Number));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < from.size(); ++i) value |= std::uint64_t{from[i]} << (8 * i);
    return static_cast<Number>(value);
  }
  /// Reads a length of 32 bits, and then as many bytes.
  std::span<const std::uint8_t> prefixed() noexcept { return bytes(number<std::uint32_t>()); }
  std::string_view text() noexcept {
    const auto from = prefixed();
    return {reinterpret_cast<const char*>(from.data()), from.size()};
  }
  std::span<const std::uint8_t> bytes(std::uint64_t count) noexcept {
    if (count > left_.size()) {
      good_ = false;
      left_ = {};
      return {};
    }
    const auto result = left_.first(static_cast<std::size_t>(count));
    left_ = left_.subspan(result.size());
    return result;
  }
  [[nodiscard]] bool good() const noexcept { return good_; }
  [[nodiscard]] std::size_t left() const noexcept { return left_.size(); }

 private:
  std::span<const std::uint8_t> left_;
  bool good_ = true;
};

/// A file whose messages are in chunks of records; an index may follow each chunk.
class ChunkedFile : public RecordingFile {
 public:
  ~ChunkedFile() override;
  ChunkedFile(const ChunkedFile&) = delete;
  ChunkedFile& operator=(const ChunkedFile&) = delete;
  [[nodiscard]] std::vector<std::optional<TimeSpan>> blocks() const override;
  void list(std::size_t block, const std::vector<bool>& chosen_topics, const TimeSpan& within,
            std::size_t max_locations, std::vector<MessageLocation>& locations) const override;
  [[nodiscard]] RecordedMessage read(const MessageLocation& location) const override;

 protected:
  struct Entry {
    std::int64_t time_ns;
    std::uint32_t topic;
    std::uint32_t offset;  ///< position of the record within the block
  };
  struct Block {
    std::uint64_t at = 0;     ///< of the chunk's record, or of the first record of a loose block
    std::uint64_t bytes = 0;  ///< only of a loose block: messages outside of chunks
    bool is_loose = false;
    bool is_cut = false;  ///< the file ends within the chunk
    std::optional<TimeSpan> time;
    std::uint64_t index_at = 0;                 ///< position of the index that follows the chunk
    std::uint64_t index_bytes = 0;              ///< 0: no index
    std::uint64_t messages = 0;                 ///< number of entries in the index
    std::optional<std::vector<Entry>> entries;  ///< of blocks without an index
  };
  /// Header in front of a chunk's bytes.
  struct ChunkHead {
    std::uint64_t at = 0;  ///< position of the packed bytes in the file
    std::uint64_t packed_bytes = 0;
    std::uint64_t unpacked_bytes = 0;
    Packing packing = Packing::none;
    std::uint32_t sum = 0;  ///< CRC-32 of the unpacked bytes; 0: none
  };

  ChunkedFile(std::filesystem::path path, const RecordingLimits& limits);

  /// Reads the head of the chunk of a block. Throws FileError on damage.
  [[nodiscard]] virtual ChunkHead read_chunk_head(const Block& block) const = 0;
  /// Appends the entries of the index after the chunk. False if it is damaged.
  virtual bool list_index_entries(const Block& block, std::vector<Entry>& entries) const = 0;
  /// Parses the message whose record begins at `offset`, without owner; `nullopt` if there is none.
  [[nodiscard]] virtual std::optional<RecordedMessage> parse_message_at(
      std::span<const std::uint8_t> block, std::size_t offset) const = 0;
  /// Adds the topics that unpacked records declare.
  virtual void add_declarations(std::span<const std::uint8_t> block) = 0;
  /// Appends the messages of unpacked records up to the first damaged one. Returns true if none was
  /// damaged.
  virtual bool list_messages(std::span<const std::uint8_t> block,
                             std::vector<Entry>& entries) const = 0;

  /// Unpacks a chunk during a pass over the file, and adds its topics and a block with its
  /// messages. `is_cut` is true if the file ends within the chunk, whose beginning is then used.
  /// Warns of damage.
  void add_chunk(std::uint64_t at, bool is_cut);
  /// Adds a message outside of chunks, whose record has `bytes` bytes at `at`.
  void add_loose_message(std::uint64_t at, std::uint64_t bytes, std::int64_t time_ns,
                         std::uint32_t topic);
  /// Warns that the file ends, or is damaged, at this byte.
  void warn_of_cut(std::uint64_t at) const;
  /// The size of the file when it was opened.
  [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
  /// Reads `count` bytes of the file. Throws FileError if the file ends before.
  [[nodiscard]] Buffer read_bytes_at(std::uint64_t at, std::uint64_t count) const;
  /// Returns `max_bytes` bytes at a position, fewer at the end of the file; reads ahead, for passes
  /// over many small records. They are valid until the next call.
  [[nodiscard]] std::span<const std::uint8_t> peek(std::uint64_t at, std::size_t max_bytes);

  RecordingLimits limits_;
  std::vector<Block> blocks_;

 private:
  void read_bytes(std::uint64_t at, std::span<std::uint8_t> to) const;
  [[nodiscard]] Buffer unpack_block(const Block& block) const;
  [[nodiscard]] std::shared_ptr<const Buffer> content(std::uint64_t block) const;
  void count_message(Block& block, const Entry& entry);

  int descriptor_ = -1;
  std::uint64_t size_ = 0;
  std::size_t counted_messages_ = 0;
  std::uint64_t read_ahead_at_ = 0;
  Buffer read_ahead_;
  mutable std::mutex cache_mutex_;
  mutable std::list<std::pair<std::uint64_t, std::shared_ptr<const Buffer>>> cache_;
};

/// First bytes of MCAP files and of ROS 1 bags.
inline constexpr std::string_view mcap_magic = "\x89MCAP0\r\n";
inline constexpr std::string_view bag_magic = "#ROSBAG V2.0\n";
[[nodiscard]] bool begins_with(std::span<const std::uint8_t> bytes, std::string_view text) noexcept;

[[nodiscard]] std::unique_ptr<RecordingFile> open_mcap(const std::filesystem::path& path,
                                                       const RecordingLimits& limits);
[[nodiscard]] std::unique_ptr<RecordingFile> open_ros1_bag(const std::filesystem::path& path,
                                                           const RecordingLimits& limits);
[[nodiscard]] std::unique_ptr<RecordingFile> open_rosbag2_database(
    const std::filesystem::path& path, const RecordingLimits& limits);

}  // namespace panonav::recordings
