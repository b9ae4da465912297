#include "panonav_recordings/internal/recording_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "panonav/core/text.hpp"

namespace panonav::recordings {

namespace {

constexpr std::uint64_t loose_block_bytes = 4U << 20U;
constexpr std::size_t cache_bytes = 16U << 20U;
constexpr std::size_t read_ahead_bytes = 64U << 10U;
constexpr std::size_t max_warnings = 20;

std::string system_message() {
  return std::generic_category().message(errno);
}

std::string describe_chunk(std::uint64_t at) {
  return "the chunk at byte " + std::to_string(at);
}

}  // namespace

bool begins_with(std::span<const std::uint8_t> bytes, std::string_view text) noexcept {
  return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

std::vector<std::string> RecordingFile::warnings() const {
  const std::lock_guard lock(warnings_mutex_);
  auto lines = warnings_;
  if (suppressed_warnings_ > 0) {
    lines.push_back(path_.string() + ": " + std::to_string(suppressed_warnings_) +
                    " more warnings");
  }
  return lines;
}

void RecordingFile::warn(std::string_view what) const {
  warn(FileError(path_.string(), what));
}

void RecordingFile::set_reported_path(const std::filesystem::path& name) {
  const std::string before = path_.string() + ": ";
  for (std::string& warning : warnings_) {
    if (warning.starts_with(before)) warning.replace(0, before.size() - 2, name.string());
  }
  path_ = name;
}

void RecordingFile::warn(const FileError& error) const {
  const std::string line = to_readable_line(error.what());
  const std::lock_guard lock(warnings_mutex_);
  if (std::ranges::find(warnings_, line) != warnings_.end()) return;
  if (warnings_.size() < max_warnings) {
    warnings_.push_back(line);
  } else {
    ++suppressed_warnings_;
  }
}

void RecordingFile::fail(std::string_view what) const {
  throw FileError(path_.string(), to_readable_line(what));
}

void RecordingFile::check_message_limit(std::size_t locations, std::size_t max_locations) const {
  if (locations > max_locations) {
    fail("has too many messages to list; allowed: up to " + std::to_string(max_locations));
  }
}

std::uint32_t RecordingFile::get_or_create_topic(std::string_view name, std::string_view type,
                                                 std::string_view encoding) {
  RecordedTopic topic;
  topic.name = name;
  topic.type = type;
  // Types of ROS 2 have a folder "/msg/" in their name, types of ROS 1 do not.
  if (const auto folder = topic.type.find("/msg/"); folder != std::string::npos) {
    topic.type.erase(folder, 4);
  }
  if (encoding == "cdr") topic.encoding = MessageEncoding::cdr;
  if (encoding == "ros1") topic.encoding = MessageEncoding::ros1;
  if (encoding == "protobuf") topic.encoding = MessageEncoding::protobuf;
  topic.encoding_name = encoding;
  std::string key = topic.name + '\n' + topic.type + '\n' + std::string(encoding);
  const auto [found, is_new] =
      topic_numbers_.try_emplace(std::move(key), static_cast<std::uint32_t>(topics_.size()));
  if (is_new) topics_.push_back(std::move(topic));
  return found->second;
}

void RecordingFile::forget_topics() noexcept {
  topics_.clear();
  topic_numbers_.clear();
}

ChunkedFile::ChunkedFile(std::filesystem::path path, const RecordingLimits& limits)
    : RecordingFile(std::move(path)), limits_(limits) {
  constexpr std::size_t addressable = 0xFFFF'FF00U;
  limits_.chunk_bytes = std::min(limits_.chunk_bytes, addressable);
  descriptor_ = ::open(this->path().c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) fail("cannot be read: " + system_message());
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) fail("cannot be read: " + system_message());
  size_ = static_cast<std::uint64_t>(status.st_size);
}

ChunkedFile::~ChunkedFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void ChunkedFile::read_bytes(std::uint64_t at, std::span<std::uint8_t> to) const {
  while (!to.empty()) {
    const ssize_t got = ::pread(descriptor_, to.data(), to.size(), static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail("cannot be read: " + system_message());
    if (got == 0) fail("ends before byte " + std::to_string(at + to.size()));
    at += static_cast<std::uint64_t>(got);
    to = to.subspan(static_cast<std::size_t>(got));
  }
}

Buffer ChunkedFile::read_bytes_at(std::uint64_t at, std::uint64_t count) const {
  if (at > size_ || count > size_ - at)
    fail("ends before byte " + std::to_string(at) + " + " + std::to_string(count));
  Buffer buffer(static_cast<std::size_t>(count));
  read_bytes(at, {buffer.data.get(), buffer.size});
  return buffer;
}

std::span<const std::uint8_t> ChunkedFile::peek(std::uint64_t at, std::size_t max_bytes) {
  if (at >= size_) return {};
  max_bytes = static_cast<std::size_t>(std::min<std::uint64_t>(max_bytes, size_ - at));
  if (at < read_ahead_at_ || at + max_bytes > read_ahead_at_ + read_ahead_.size) {
    read_ahead_ = read_bytes_at(
        at, std::min<std::uint64_t>(std::max(max_bytes, read_ahead_bytes), size_ - at));
    read_ahead_at_ = at;
  }
  return read_ahead_.bytes().subspan(static_cast<std::size_t>(at - read_ahead_at_), max_bytes);
}

void ChunkedFile::warn_of_cut(std::uint64_t at) const {
  warn(at >= size_ ? "was not closed or is cut off; the existing part is read"
                   : "is damaged or cut off at byte " + std::to_string(at) + " of " +
                         std::to_string(size_) + "; the part before it is read");
}

std::vector<std::optional<TimeSpan>> ChunkedFile::blocks() const {
  std::vector<std::optional<TimeSpan>> times;
  times.reserve(blocks_.size());
  for (const Block& block : blocks_) times.push_back(block.time);
  return times;
}

Buffer ChunkedFile::unpack_block(const Block& block) const {
  if (block.is_loose) return read_bytes_at(block.at, block.bytes);
  const ChunkHead head = read_chunk_head(block);
  if (std::max(head.packed_bytes, head.unpacked_bytes) > limits_.chunk_bytes) {
    fail(describe_chunk(block.at) + " has " +
         std::to_string(std::max(head.packed_bytes, head.unpacked_bytes)) +
         " bytes; allowed: up to " + std::to_string(limits_.chunk_bytes));
  }
  // A hostile chunk of a few bytes may state a size of hundreds of megabytes, which takes seconds
  // to unpack. 20,000 is the highest ratio of bzip2, reached by black images; `free_bytes` allows a
  // small chunk any ratio.
  constexpr std::uint64_t free_bytes = 8U << 20U;
  constexpr std::uint64_t max_ratio = 20'000;
  const std::uint64_t max_bytes = free_bytes + max_ratio * head.packed_bytes;
  if (head.unpacked_bytes > max_bytes) {
    fail(describe_chunk(block.at) + " has " + std::to_string(head.packed_bytes) +
         " bytes that claim to unpack to " + std::to_string(head.unpacked_bytes) +
         "; allowed: up to " + std::to_string(max_bytes));
  }
  const auto there = head.at > size_ ? 0 : size_ - head.at;
  const auto count = block.is_cut ? std::min(head.packed_bytes, there) : head.packed_bytes;
  Buffer packed = read_bytes_at(head.at, count);
  if (head.packing == Packing::none) {
    if (head.unpacked_bytes != head.packed_bytes) {
      fail(describe_chunk(block.at) + " is damaged: it tells two sizes");
    }
  } else {
    auto unpacked =
        unpack(packed.bytes(), head.packing, static_cast<std::size_t>(head.unpacked_bytes));
    packed = std::move(unpacked.content);
    if (!block.is_cut && !(unpacked.is_whole && packed.size == head.unpacked_bytes)) {
      fail(describe_chunk(block.at) + " is damaged: it cannot be unpacked");
    }
  }
  if (!block.is_cut && head.sum != 0 &&
      ::crc32(0, packed.data.get(), static_cast<uInt>(packed.size)) != head.sum) {
    fail(describe_chunk(block.at) + " is damaged: its checksum is wrong");
  }
  return packed;
}

std::shared_ptr<const Buffer> ChunkedFile::content(std::uint64_t block) const {
  if (block >= blocks_.size()) fail("has no block " + std::to_string(block));
  // Only one thread unpacks at a time: the others mostly want the same chunk, and memory stays
  // limited.
  const std::lock_guard lock(cache_mutex_);
  const auto found =
      std::ranges::find(cache_, block, [](const auto& cached) { return cached.first; });
  if (found != cache_.end()) {
    cache_.splice(cache_.begin(), cache_, found);
    return cache_.front().second;
  }
  std::size_t kept = 0;
  for (const auto& cached : cache_) kept += cached.second->size;
  while (kept > cache_bytes) {
    kept -= cache_.back().second->size;
    cache_.pop_back();
  }
  auto buffer = std::make_shared<const Buffer>(unpack_block(blocks_[block]));
  cache_.emplace_front(block, buffer);
  return buffer;
}

void ChunkedFile::list(std::size_t block, const std::vector<bool>& chosen_topics,
                       const TimeSpan& within, std::size_t max_locations,
                       std::vector<MessageLocation>& locations) const {
  const Block& from = blocks_.at(block);
  std::vector<Entry> read;
  if (!from.entries && (!list_index_entries(from, read) || read.size() != from.messages)) {
    warn("the index of " + describe_chunk(from.at) + " is damaged; the chunk itself is read");
    read.clear();
    if (!list_messages(content(block)->bytes(), read)) {
      warn(describe_chunk(from.at) + " is damaged; the part before the damage is read");
    }
  }
  for (const Entry& entry : from.entries ? *from.entries : read) {
    if (!chosen_topics[entry.topic] || entry.time_ns < within.begin_ns ||
        entry.time_ns > within.end_ns) {
      continue;
    }
    locations.push_back({entry.time_ns, entry.topic, 0, block, entry.offset});
    check_message_limit(locations.size(), max_locations);
  }
}

RecordedMessage ChunkedFile::read(const MessageLocation& location) const {
  auto block = content(location.block);
  std::optional<RecordedMessage> message;
  if (location.offset < block->size) message = parse_message_at(block->bytes(), location.offset);
  if (!message) {
    fail(describe_chunk(blocks_[location.block].at) + " has no message where its index says");
  }
  message->owner = std::move(block);
  return *std::move(message);
}

void ChunkedFile::count_message(Block& block, const Entry& entry) {
  ++topics_[entry.topic].messages;
  check_message_limit(++counted_messages_, limits_.messages);
  if (!block.time) block.time = TimeSpan{entry.time_ns, entry.time_ns};
  block.time->begin_ns = std::min(block.time->begin_ns, entry.time_ns);
  block.time->end_ns = std::max(block.time->end_ns, entry.time_ns);
}

void ChunkedFile::add_chunk(std::uint64_t at, bool is_cut) {
  Block block;
  block.at = at;
  block.is_cut = is_cut;
  try {
    const Buffer content = unpack_block(block);
    add_declarations(content.bytes());
    std::vector<Entry> entries;
    if (!list_messages(content.bytes(), entries) && !is_cut) {
      warn(describe_chunk(at) + " is damaged; the part before the damage is read");
    }
    if (entries.empty()) return;
    for (const Entry& entry : entries) count_message(block, entry);
    entries.shrink_to_fit();
    block.entries = std::move(entries);
  } catch (const FileError& error) {
    if (counted_messages_ > limits_.messages) throw;
    if (!is_cut) warn(error);
    return;
  }
  blocks_.push_back(std::move(block));
}

void ChunkedFile::add_loose_message(std::uint64_t at, std::uint64_t bytes, std::int64_t time_ns,
                                    std::uint32_t topic) {
  if (bytes > limits_.chunk_bytes) {
    warn("the message at byte " + std::to_string(at) + " has " + std::to_string(bytes) +
         " bytes and is left out; allowed: up to " + std::to_string(limits_.chunk_bytes));
    return;
  }
  if (blocks_.empty() || !blocks_.back().is_loose ||
      blocks_.back().at + blocks_.back().bytes != at ||
      blocks_.back().bytes + bytes > loose_block_bytes) {
    Block block;
    block.at = at;
    block.is_loose = true;
    block.entries.emplace();
    blocks_.push_back(std::move(block));
  }
  Block& block = blocks_.back();
  const Entry entry{time_ns, topic, static_cast<std::uint32_t>(at - block.at)};
  count_message(block, entry);
  block.entries->push_back(entry);
  block.bytes += bytes;
}

}  // namespace panonav::recordings
