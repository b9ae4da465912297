// ROS 1 bags, version 2.0 (http://wiki.ros.org/Bags/Format/2.0).
#include <algorithm>

#include "panonav_recordings/internal/recording_file.hpp"

namespace panonav::recordings {

namespace {

enum class BagRecord : std::uint8_t {
  message = 2,
  bag_header = 3,
  index_data = 4,
  chunk = 5,
  chunk_info = 6,
  connection = 7,
};

// Fields "NAME=VALUE" of a record's header, each preceded by its length.
class BagFields {
 public:
  explicit BagFields(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> find(std::string_view name) const {
    Fields fields(bytes_);
    while (fields.left() > 0) {
      const auto field = fields.prefixed();
      if (!fields.good()) break;
      if (field.size() > name.size() && begins_with(field, name) && field[name.size()] == '=') {
        return field.subspan(name.size() + 1);
      }
    }
    return std::nullopt;
  }
  template <class Number>
  [[nodiscard]] std::optional<Number> number(std::string_view name) const {
    const auto field = find(name);
    if (!field || field->size() != sizeof(Number)) return std::nullopt;
    return Fields(*field).number<Number>();
  }
  [[nodiscard]] std::string_view text(std::string_view name) const {
    const auto field = find(name).value_or(std::span<const std::uint8_t>{});
    return {reinterpret_cast<const char*>(field.data()), field.size()};
  }
  [[nodiscard]] std::optional<BagRecord> kind() const {
    const auto op = number<std::uint8_t>("op");
    return op ? std::optional(static_cast<BagRecord>(*op)) : std::nullopt;
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

// Converts a ROS 1 time, with seconds in the lower and nanoseconds in the upper 32 bits.
std::int64_t bag_time_to_ns(std::uint64_t stamp) {
  constexpr std::int64_t second_ns = 1'000'000'000;
  return static_cast<std::int64_t>(stamp & 0xFFFF'FFFFU) * second_ns +
         static_cast<std::int64_t>(stamp >> 32U);
}

class BagFile : public ChunkedFile {
 public:
  BagFile(const std::filesystem::path& path, const RecordingLimits& limits)
      : ChunkedFile(path, limits) {
    constexpr std::uint64_t max_head = 4096;
    const auto first = peek(bag_magic.size(), max_head);
    const BagFields head(Fields(first).prefixed());
    if (head.kind() != BagRecord::bag_header) fail("is damaged: it does not begin with its head");
    if (!head.text("encryptor").empty()) {
      fail("is encrypted by '" + std::string(head.text("encryptor")) +
           "'; allowed: bags that are not");
    }
    const std::uint64_t index_at = head.number<std::uint64_t>("index_pos").value_or(0);
    const auto chunks = head.number<std::uint32_t>("chunk_count").value_or(0);
    if (index_at != 0 && index_at <= size() && read_index(index_at, chunks)) return;
    if (index_at != 0 && index_at <= size()) {
      warn("its index is damaged; the whole file is read");
    }
    blocks_.clear();
    forget_topics();
    connections_.clear();
    scan(index_at);
  }

 protected:
  [[nodiscard]] ChunkHead read_chunk_head(const Block& block) const override {
    constexpr std::uint64_t max_head_bytes = 4096;
    const Buffer bytes =
        read_bytes_at(block.at, std::min(max_head_bytes, size() - std::min(block.at, size())));
    Fields fields(bytes.bytes());
    const auto header = fields.prefixed();
    const BagFields named(header);
    ChunkHead head;
    head.packed_bytes = fields.number<std::uint32_t>();
    const auto unpacked = named.number<std::uint32_t>("size");
    const std::string_view name = named.text("compression");
    const std::string where = "the chunk at byte " + std::to_string(block.at);
    if (!fields.good() || named.kind() != BagRecord::chunk || !unpacked) {
      fail(where + " is damaged: its head is wrong");
    }
    const auto packing = parse_packing(name);
    if (!packing || *packing == Packing::zstd) {
      fail(where + " is packed by '" + std::string(name) + "'; allowed: none, bz2, lz4");
    }
    head.packing = *packing;
    head.unpacked_bytes = *unpacked;
    head.at = block.at + 4 + header.size() + 4;
    return head;
  }

  bool list_index_entries(const Block& block, std::vector<Entry>& entries) const override {
    const ChunkHead head = read_chunk_head(block);
    const std::uint64_t begin = head.at + head.packed_bytes;
    const std::uint64_t end = block.index_at + block.index_bytes;
    if (begin > end || end - begin > limits_.chunk_bytes) return false;
    const Buffer bytes = read_bytes_at(begin, end - begin);
    Fields fields(bytes.bytes());
    while (fields.left() > 0) {
      const BagFields header(fields.prefixed());
      Fields data(fields.prefixed());
      if (!fields.good()) return false;
      if (header.kind() != BagRecord::index_data) continue;
      const auto topic = connections_.find(header.number<std::uint32_t>("conn").value_or(~0U));
      if (header.number<std::uint32_t>("ver") != 1U || topic == connections_.end() ||
          data.left() % 12 != 0) {
        return false;
      }
      while (data.left() > 0) {
        const auto time = bag_time_to_ns(data.number<std::uint64_t>());
        entries.push_back({time, topic->second, data.number<std::uint32_t>()});
      }
    }
    return true;
  }

  [[nodiscard]] std::optional<RecordedMessage> parse_message_at(std::span<const std::uint8_t> block,
                                                                std::size_t offset) const override {
    Fields fields(block.subspan(offset));
    const BagFields header(fields.prefixed());
    const auto data = fields.prefixed();
    if (!fields.good() || header.kind() != BagRecord::message) return std::nullopt;
    return parse_message(header, data);
  }

  void add_declarations(std::span<const std::uint8_t> block) override {
    Fields fields(block);
    while (fields.left() > 0) {
      const BagFields header(fields.prefixed());
      const BagFields data(fields.prefixed());
      if (fields.good() && header.kind() == BagRecord::connection) add_connection(header, data);
    }
  }

  bool list_messages(std::span<const std::uint8_t> block,
                     std::vector<Entry>& entries) const override {
    Fields fields(block);
    while (fields.left() > 0) {
      const auto offset = static_cast<std::uint32_t>(block.size() - fields.left());
      const BagFields header(fields.prefixed());
      const auto data = fields.prefixed();
      if (!fields.good()) return false;
      if (header.kind() != BagRecord::message) continue;
      if (const auto message = parse_message(header, data)) {
        entries.push_back({message->time_ns, message->topic, offset});
      }
    }
    return true;
  }

 private:
  [[nodiscard]] std::optional<RecordedMessage> parse_message(
      const BagFields& header, std::span<const std::uint8_t> data) const {
    const auto connection = header.number<std::uint32_t>("conn");
    const auto time = header.number<std::uint64_t>("time");
    const auto topic = connections_.find(connection.value_or(~0U));
    if (!connection || !time || topic == connections_.end()) {
      warn("messages of connection " +
           (connection ? std::to_string(*connection) : "without number") +
           " are left out: the connection is not described");
      return std::nullopt;
    }
    RecordedMessage message;
    message.time_ns = bag_time_to_ns(*time);
    message.topic = topic->second;
    message.bytes = data;
    return message;
  }

  void add_connection(const BagFields& header, const BagFields& data) {
    const auto number = header.number<std::uint32_t>("conn");
    if (!number || connections_.contains(*number)) return;
    connections_.emplace(*number,
                         get_or_create_topic(header.text("topic"), data.text("type"), "ros1"));
  }

  // Reads the index at the end of the bag: its connections, and times and counts of the chunks.
  // Returns false if it is damaged.
  bool read_index(std::uint64_t index_at, std::uint32_t chunks) {
    if (index_at < bag_magic.size() || size() - index_at > limits_.chunk_bytes) return false;
    const Buffer bytes = read_bytes_at(index_at, size() - index_at);
    Fields fields(bytes.bytes());
    while (fields.left() > 0) {
      const BagFields header(fields.prefixed());
      const auto data = fields.prefixed();
      const auto kind = header.kind();
      if (!fields.good() || !kind) return false;
      if (*kind == BagRecord::connection) add_connection(header, BagFields(data));
      if (*kind != BagRecord::chunk_info) continue;
      Block block;
      const auto at = header.number<std::uint64_t>("chunk_pos");
      const auto begin = header.number<std::uint64_t>("start_time");
      const auto end = header.number<std::uint64_t>("end_time");
      if (!at || !begin || !end || *at < bag_magic.size() || *at >= index_at) return false;
      block.at = block.index_at = *at;
      Fields counts(data);
      while (counts.left() > 0) {
        const auto topic = connections_.find(counts.number<std::uint32_t>());
        const std::uint64_t count = counts.number<std::uint32_t>();
        if (!counts.good() || topic == connections_.end()) return false;
        topics_[topic->second].messages += count;
        block.messages += count;
      }
      if (block.messages > 0) block.time = TimeSpan{bag_time_to_ns(*begin), bag_time_to_ns(*end)};
      blocks_.push_back(std::move(block));
    }
    if (blocks_.size() != chunks) return false;
    // The index of a chunk ends where the next chunk begins.
    std::ranges::sort(blocks_, {}, &Block::at);
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      const std::uint64_t next = i + 1 < blocks_.size() ? blocks_[i + 1].at : index_at;
      if (next == blocks_[i].at) return false;
      blocks_[i].index_bytes = next - blocks_[i].at;
    }
    return true;
  }

  void scan(std::uint64_t index_at) {
    constexpr std::uint32_t max_header = 1U << 20U;
    std::uint64_t at = bag_magic.size();
    while (at != index_at) {
      const auto length = Fields(peek(at, 4)).number<std::uint32_t>();
      if (length > max_header) break;
      Fields fields(peek(at, 4 + length + 4));
      const BagFields header(fields.prefixed());
      const std::uint64_t data_bytes = fields.number<std::uint32_t>();
      const auto kind = header.kind();
      if (!fields.good() || !kind) break;
      const std::uint64_t data_at = at + 4 + length + 4;
      const bool is_cut = data_bytes > size() - data_at;
      if (*kind == BagRecord::chunk) {
        add_chunk(at, is_cut);
      } else if (is_cut) {
        break;
      } else if (*kind == BagRecord::message) {
        // A killed recorder leaves the messages of its last chunk outside of any chunk.
        if (const auto message = parse_message(header, {})) {
          add_loose_message(at, data_at + data_bytes - at, message->time_ns, message->topic);
        }
      } else if (*kind == BagRecord::connection && data_bytes <= limits_.chunk_bytes) {
        const Buffer data = read_bytes_at(data_at, data_bytes);
        add_connection(BagFields(Fields(peek(at, 4 + length)).prefixed()), BagFields(data.bytes()));
      }
      if (is_cut) break;
      at = data_at + data_bytes;
    }
    if (at != index_at) warn_of_cut(at);
  }

  std::unordered_map<std::uint32_t, std::uint32_t> connections_;  // topic numbers by connection id
};

}  // namespace

std::unique_ptr<RecordingFile> open_ros1_bag(const std::filesystem::path& path,
                                             const RecordingLimits& limits) {
  return std::make_unique<BagFile>(path, limits);
}

}  // namespace panonav::recordings
