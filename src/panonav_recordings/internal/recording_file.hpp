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

/// One file of a recording. Topics are those of the file. All of it but opening may be called by
/// several threads at a time.
class RecordingFile {
 public:
  virtual ~RecordingFile() = default;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  [[nodiscard]] const std::vector<RecordedTopic>& topics() const noexcept { return topics_; }
  [[nodiscard]] std::vector<std::string> warnings() const;
  /// Returns the span of the messages' times of each block; nullopt for a block without messages.
  [[nodiscard]] virtual std::vector<std::optional<TimeSpan>> blocks() const = 0;
  /// Appends the places of the messages of a block that are of the chosen topics and within the
  /// span, in any order. Throws FileError beyond `max_places` places in all.
  virtual void list(std::size_t block, const std::vector<bool>& chosen_topics,
                    const TimeSpan& within, std::size_t max_places,
                    std::vector<MessageLocation>& places) const = 0;
  /// Throws FileError on damage.
  [[nodiscard]] virtual RecordedMessage read(const MessageLocation& place) const = 0;
  /// Adds the line "PATH: what" to the warnings, once.
  void warn(std::string_view what) const;
  void warn(const FileError& error) const;
  /// Messages name this file instead: what was opened is a copy of it.
  void call(const std::filesystem::path& name);

 protected:
  explicit RecordingFile(std::filesystem::path path) : path_(std::move(path)) {}
  /// The topic of this name, type and encoding, which is made where there is none.
  std::uint32_t topic_of(std::string_view name, std::string_view type, std::string_view encoding);
  void forget_topics() noexcept;
  /// Throws FileError when there are more places than allowed.
  void check_message_limit(std::size_t places, std::size_t max_places) const;
  [[noreturn]] void fail(std::string_view what) const;

  std::vector<RecordedTopic> topics_;

 private:
  std::filesystem::path path_;
  std::unordered_map<std::string, std::uint32_t> topic_numbers_;
  mutable std::mutex warnings_mutex_;
  mutable std::vector<std::string> warnings_;
  mutable std::size_t suppressed_warnings_ = 0;
};

/// Little-endian fields of bytes that may end early: what is missing is 0 or empty, and `good` is
/// false from then on.
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
  /// Bytes after their number, of 32 bits.
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

/// A file of chunks of records, each with an index behind it or none.
class ChunkedFile : public RecordingFile {
 public:
  ~ChunkedFile() override;
  ChunkedFile(const ChunkedFile&) = delete;
  ChunkedFile& operator=(const ChunkedFile&) = delete;
  [[nodiscard]] std::vector<std::optional<TimeSpan>> blocks() const override;
  void list(std::size_t block, const std::vector<bool>& chosen_topics, const TimeSpan& within,
            std::size_t max_places, std::vector<MessageLocation>& places) const override;
  [[nodiscard]] RecordedMessage read(const MessageLocation& place) const override;

 protected:
  struct Entry {
    std::int64_t time_ns;
    std::uint32_t topic;
    std::uint32_t offset;  ///< of the record in the block
  };
  struct Block {
    std::uint64_t at = 0;     ///< of the chunk's record; of the first record of a loose block
    std::uint64_t bytes = 0;  ///< of a loose block: messages beside one another outside of chunks
    bool is_loose = false;
    bool is_cut = false;  ///< the file ends within the chunk
    std::optional<TimeSpan> time;
    std::uint64_t index_at = 0;                 ///< of the index behind the chunk
    std::uint64_t index_bytes = 0;              ///< 0: there is none
    std::uint64_t messages = 0;                 ///< that the index has
    std::optional<std::vector<Entry>> entries;  ///< of files without an index
  };
  /// Header in front of a chunk's bytes.
  struct ChunkHead {
    std::uint64_t at = 0;  ///< of the packed bytes
    std::uint64_t packed_bytes = 0;
    std::uint64_t unpacked_bytes = 0;
    Packing packing = Packing::none;
    std::uint32_t sum = 0;  ///< CRC-32 of the unpacked bytes; 0: none
  };

  ChunkedFile(std::filesystem::path path, const RecordingLimits& limits);

  /// Throws a FileError on damage.
  [[nodiscard]] virtual ChunkHead chunk_head(const Block& block) const = 0;
  /// Appends the entries of the index after the chunk. False if it is damaged.
  virtual bool list_index_entries(const Block& block, std::vector<Entry>& entries) const = 0;
  /// The message whose record begins there, without owner; empty where none does.
  [[nodiscard]] virtual std::optional<RecordedMessage> message_at(
      std::span<const std::uint8_t> block, std::size_t offset) const = 0;
  /// Notes the topics that unpacked records declare.
  virtual void declare(std::span<const std::uint8_t> block) = 0;
  /// Appends the messages of unpacked records up to the first damaged one. Whether all were whole.
  virtual bool walk(std::span<const std::uint8_t> block, std::vector<Entry>& entries) const = 0;

  /// Unpacks a chunk during a pass over the file, notes its topics and messages and makes a
  /// block of it. `is_cut`: the file ends within the chunk; its beginning is kept. Warns of
  /// damage.
  void add_chunk(std::uint64_t at, bool is_cut);
  /// A message outside of chunks, in the record of `bytes` bytes at `at`.
  void add_loose_message(std::uint64_t at, std::uint64_t bytes, std::int64_t time_ns,
                         std::uint32_t topic);
  /// The file ends, or is damaged from there on.
  void warn_of_cut(std::uint64_t at) const;
  /// The size of the file when it was opened.
  [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
  /// Reads `count` bytes of the file. Throws FileError where it lacks them.
  [[nodiscard]] Buffer read_bytes_at(std::uint64_t at, std::uint64_t count) const;
  /// Returns bytes for small records one after another, reading ahead; fewer at the end of the
  /// file. They are valid until the next call.
  [[nodiscard]] std::span<const std::uint8_t> peek(std::uint64_t at, std::size_t max_bytes);

  RecordingLimits limits_;
  std::vector<Block> blocks_;

 private:
  void read_bytes(std::uint64_t at, std::span<std::uint8_t> to) const;
  [[nodiscard]] Buffer unpack_block(const Block& block) const;
  [[nodiscard]] std::shared_ptr<const Buffer> content(std::uint64_t block) const;
  void note(Block& block, const Entry& entry);

  int descriptor_ = -1;
  std::uint64_t size_ = 0;
  std::size_t noted_ = 0;
  std::uint64_t ahead_at_ = 0;
  Buffer ahead_;
  mutable std::mutex cache_mutex_;
  mutable std::list<std::pair<std::uint64_t, std::shared_ptr<const Buffer>>> cache_;
};

/// Their first bytes.
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
