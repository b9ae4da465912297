// MCAP, version 0 (https://mcap.dev/spec).
#include <zlib.h>

#include <algorithm>
#include <limits>

#include "panonav_recordings/internal/mcap_records.hpp"
#include "panonav_recordings/internal/recording_file.hpp"

namespace panonav::recordings {

namespace {

constexpr std::size_t head_bytes = 9;
constexpr std::size_t message_head_bytes = 22;
constexpr std::size_t footer_bytes = head_bytes + 20 + 8;

std::int64_t to_time_ns(std::uint64_t time) {
  constexpr auto last = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  return static_cast<std::int64_t>(std::min(time, last));
}

class McapFile : public ChunkedFile {
 public:
  McapFile(const std::filesystem::path& path, const RecordingLimits& limits)
      : ChunkedFile(path, limits) {
    const bool is_indexed = read_summary();
    if (!is_indexed) {
      blocks_.clear();
      forget_topics();
      channels_.clear();
      schemas_.clear();
      scan();
    }
  }

 protected:
  [[nodiscard]] ChunkHead read_chunk_head(const Block& block) const override {
    constexpr std::uint64_t max_head_bytes = head_bytes + 8 + 8 + 8 + 4 + 4 + 32 + 8;
    const Buffer bytes =
        read_bytes_at(block.at, std::min(max_head_bytes, size() - std::min(block.at, size())));
    Fields fields(bytes.bytes());
    const auto kind = fields.number<McapRecord>();
    const auto length = fields.number<std::uint64_t>();
    fields.bytes(16);  // times
    ChunkHead head;
    head.unpacked_bytes = fields.number<std::uint64_t>();
    head.sum = fields.number<std::uint32_t>();
    const std::string_view name = fields.text();
    head.packed_bytes = fields.number<std::uint64_t>();
    const std::uint64_t fixed = 8 + 8 + 8 + 4 + 4 + name.size() + 8;
    if (kind != McapRecord::chunk || !fields.good() || length < fixed ||
        head.packed_bytes != length - fixed) {
      fail("the chunk at byte " + std::to_string(block.at) + " is damaged: its head is wrong");
    }
    const auto packing = parse_packing(name);
    if (!packing || *packing == Packing::bz2) {
      fail("the chunk at byte " + std::to_string(block.at) + " is packed by '" + std::string(name) +
           "'; allowed: none, lz4, zstd");
    }
    head.packing = *packing;
    head.at = block.at + head_bytes + fixed;
    return head;
  }

  bool list_index_entries(const Block& block, std::vector<Entry>& entries) const override {
    if (block.index_bytes > limits_.chunk_bytes) return false;
    const Buffer bytes = read_bytes_at(block.index_at, block.index_bytes);
    Fields fields(bytes.bytes());
    while (fields.left() > 0) {
      const auto kind = fields.number<McapRecord>();
      Fields record(fields.bytes(fields.number<std::uint64_t>()));
      const auto channel = channels_.find(record.number<std::uint16_t>());
      Fields list(record.prefixed());
      if (kind != McapRecord::message_index || !fields.good() || !record.good() ||
          list.left() % 16 != 0 || (list.left() > 0 && channel == channels_.end())) {
        return false;
      }
      while (list.left() > 0) {
        const auto time = to_time_ns(list.number<std::uint64_t>());
        const auto offset = list.number<std::uint64_t>();
        if (offset > std::numeric_limits<std::uint32_t>::max()) return false;
        entries.push_back({time, channel->second, static_cast<std::uint32_t>(offset)});
      }
    }
    return true;
  }

  [[nodiscard]] std::optional<RecordedMessage> parse_message_at(std::span<const std::uint8_t> block,
                                                                std::size_t offset) const override {
    Fields fields(block.subspan(offset));
    const auto kind = fields.number<McapRecord>();
    const auto body = fields.bytes(fields.number<std::uint64_t>());
    if (kind != McapRecord::message || body.size() < message_head_bytes) return std::nullopt;
    return parse_message(body);
  }

  void add_declarations(std::span<const std::uint8_t> block) override {
    Fields fields(block);
    while (fields.left() > 0) {
      const auto kind = fields.number<McapRecord>();
      const auto body = fields.bytes(fields.number<std::uint64_t>());
      if (fields.good()) add_declaration(kind, body);
    }
  }

  bool list_messages(std::span<const std::uint8_t> block,
                     std::vector<Entry>& entries) const override {
    Fields fields(block);
    while (fields.left() > 0) {
      const auto offset = static_cast<std::uint32_t>(block.size() - fields.left());
      const auto kind = fields.number<McapRecord>();
      const auto body = fields.bytes(fields.number<std::uint64_t>());
      if (!fields.good()) return false;
      if (kind != McapRecord::message) continue;
      if (body.size() < message_head_bytes) return false;
      if (const auto message = parse_message(body)) {
        entries.push_back({message->time_ns, message->topic, offset});
      }
    }
    return true;
  }

 private:
  // Parses the body of a message record; `nullopt` if its channel is unknown.
  [[nodiscard]] std::optional<RecordedMessage> parse_message(
      std::span<const std::uint8_t> body) const {
    Fields fields(body);
    const auto number = fields.number<std::uint16_t>();
    const auto channel = channels_.find(number);
    if (channel == channels_.end()) {
      warn("messages of channel " + std::to_string(number) +
           " are left out: the channel is not described");
      return std::nullopt;
    }
    fields.number<std::uint32_t>();  // sequence
    RecordedMessage message;
    message.time_ns = to_time_ns(fields.number<std::uint64_t>());
    message.topic = channel->second;
    message.bytes = body.subspan(std::min(message_head_bytes, body.size()));
    return message;
  }

  void add_declaration(McapRecord kind, std::span<const std::uint8_t> body) {
    Fields fields(body);
    if (kind == McapRecord::schema) {
      const auto number = fields.number<std::uint16_t>();
      const auto name = fields.text();
      if (fields.good()) schemas_.try_emplace(number, name);
    } else if (kind == McapRecord::channel) {
      const auto number = fields.number<std::uint16_t>();
      const auto schema_number = fields.number<std::uint16_t>();
      const auto schema = schemas_.find(schema_number);
      const auto name = fields.text();
      const auto encoding = fields.text();
      if (!fields.good() || channels_.contains(number)) return;
      if (schema_number != 0 && schema == schemas_.end()) lacks_schemas_ = true;
      channels_.emplace(
          number,
          get_or_create_topic(name, schema == schemas_.end() ? "" : schema->second, encoding));
    }
  }

  /// Position and checksum of the summary.
  struct Footer {
    std::uint64_t at = 0;  ///< position of the footer in the file
    std::uint64_t summary_at = 0;
    std::uint32_t sum = 0;  ///< checksum of the summary; 0: none
  };
  /// Counts of messages in the records of the summary.
  struct Summary {
    std::uint64_t indexed = 0;              ///< messages of all indexed chunks
    std::optional<std::uint64_t> messages;  ///< number in the whole file, if stated
    std::vector<std::pair<std::uint16_t, std::uint64_t>> counts;  ///< messages by channel
    bool is_complete = true;
  };

  // Returns true if the summary describes the whole file. Warns if a summary is damaged; one that
  // is missing or incomplete causes no warning here.
  bool read_summary() {
    const auto footer = read_footer();
    if (!footer) return false;  // `scan` warns of what is missing
    Summary summary;
    const bool is_read = read_records(*footer, summary);
    if (is_read && !add_counts(summary)) return false;
    std::ranges::sort(blocks_, {}, &Block::at);
    if (is_read && !has_overlapping_blocks()) return true;
    warn("its summary is damaged; the whole file is read");
    return false;
  }

  // Reads the footer; `nullopt` if there is none or it names no summary.
  std::optional<Footer> read_footer() {
    if (size() < mcap_magic.size() + footer_bytes) return std::nullopt;
    Footer footer{.at = size() - footer_bytes};
    const Buffer end = read_bytes_at(footer.at, footer_bytes);
    Fields fields(end.bytes());
    const auto kind = fields.number<McapRecord>();
    const auto length = fields.number<std::uint64_t>();
    footer.summary_at = fields.number<std::uint64_t>();
    fields.number<std::uint64_t>();  // of the offsets of groups
    footer.sum = fields.number<std::uint32_t>();
    const bool is_footer =
        kind == McapRecord::footer && length == 20 && begins_with(fields.bytes(8), mcap_magic);
    return is_footer && footer.summary_at != 0 ? std::optional(footer) : std::nullopt;
  }

  // Reads the records of the summary; false if it is damaged.
  bool read_records(const Footer& footer, Summary& summary) {
    const std::uint64_t start = footer.summary_at;
    if (start < mcap_magic.size() || start > footer.at || footer.at - start > limits_.chunk_bytes) {
      return false;
    }
    const Buffer bytes = read_bytes_at(start, footer.at - start + head_bytes + 16);
    if (footer.sum != 0 &&
        ::crc32(0, bytes.data.get(), static_cast<uInt>(bytes.size)) != footer.sum) {
      return false;
    }
    Fields fields(bytes.bytes().first(static_cast<std::size_t>(footer.at - start)));
    while (fields.left() > 0) {
      const auto record = fields.number<McapRecord>();
      const auto body = fields.bytes(fields.number<std::uint64_t>());
      if (!fields.good()) return false;
      add_declaration(record, body);
      if (record == McapRecord::chunk_index && !read_chunk_index(body, start, summary)) {
        return false;
      }
      if (record == McapRecord::statistics && !read_statistics(body, summary)) return false;
    }
    return true;
  }

  bool read_chunk_index(std::span<const std::uint8_t> body, std::uint64_t summary_at,
                        Summary& summary) {
    Fields content(body);
    Block block;
    const TimeSpan time{to_time_ns(content.number<std::uint64_t>()),
                        to_time_ns(content.number<std::uint64_t>())};
    block.at = content.number<std::uint64_t>();
    const auto chunk_bytes = content.number<std::uint64_t>();
    const auto lists = content.prefixed();
    block.index_at = block.at + chunk_bytes;
    block.index_bytes = content.number<std::uint64_t>();
    if (!content.good() || block.at < mcap_magic.size() || block.at > summary_at ||
        chunk_bytes > summary_at - block.at || block.index_bytes > summary_at - block.index_at) {
      return false;
    }
    // Each list of times and offsets has 15 bytes in addition to its pairs of 16.
    const std::uint64_t list_head_bytes = lists.size() / 10 * 15;
    if (block.index_bytes < list_head_bytes || (block.index_bytes - list_head_bytes) % 16 != 0) {
      summary.is_complete = false;
      return true;
    }
    block.messages = (block.index_bytes - list_head_bytes) / 16;
    summary.indexed += block.messages;
    if (block.messages > 0) block.time = time;
    blocks_.push_back(std::move(block));
    return true;
  }

  static bool read_statistics(std::span<const std::uint8_t> body, Summary& summary) {
    Fields content(body);
    summary.messages = content.number<std::uint64_t>();
    content.bytes(2 + 4 + 4 + 4 + 4 + 8 + 8);
    Fields list(content.prefixed());
    while (list.left() > 0) {
      const auto channel = list.number<std::uint16_t>();
      summary.counts.emplace_back(channel, list.number<std::uint64_t>());
    }
    return content.good() && list.good();
  }
  /// Adds up the messages of each topic. Returns false if the summary does not cover all messages.
  bool add_counts(const Summary& summary) {
    if (!summary.messages || summary.indexed != *summary.messages || !summary.is_complete ||
        lacks_schemas_) {
      return false;
    }
    for (const auto& [channel, count] : summary.counts) {
      const auto topic = channels_.find(channel);
      if (topic == channels_.end()) return false;
      topics_[topic->second].messages += count;
    }
    std::uint64_t counted = 0;
    for (const RecordedTopic& topic : topics_) counted += topic.messages;
    return counted == *summary.messages;
  }

  /// True if any of the sorted blocks overlap.
  [[nodiscard]] bool has_overlapping_blocks() const {
    for (std::size_t i = 1; i < blocks_.size(); ++i) {
      if (blocks_[i].at < blocks_[i - 1].index_at + blocks_[i - 1].index_bytes) return true;
    }
    return false;
  }

  void scan() {
    std::uint64_t at = mcap_magic.size();
    while (true) {
      const auto head = peek(at, head_bytes + message_head_bytes);
      Fields fields(head);
      const auto kind = fields.number<McapRecord>();
      const auto length = fields.number<std::uint64_t>();
      if (!fields.good() || kind == McapRecord{}) break;
      if (kind == McapRecord::data_end || kind == McapRecord::footer) return;
      const bool is_cut = length > size() - at - head_bytes;
      if (kind == McapRecord::chunk) {
        add_chunk(at, is_cut);
      } else if (is_cut) {
        break;
      } else if (kind == McapRecord::message && length >= message_head_bytes) {
        if (const auto message = parse_message(head.subspan(head_bytes))) {
          add_loose_message(at, head_bytes + length, message->time_ns, message->topic);
        }
      } else if ((kind == McapRecord::schema || kind == McapRecord::channel) &&
                 length <= limits_.chunk_bytes) {
        add_declaration(kind, read_bytes_at(at + head_bytes, length).bytes());
      }
      if (is_cut) break;
      at += head_bytes + length;
    }
    warn_of_cut(at);
  }

  std::unordered_map<std::uint16_t, std::uint32_t> channels_;  // topic numbers by channel id
  std::unordered_map<std::uint16_t, std::string> schemas_;     // type names by schema id
  bool lacks_schemas_ = false;
};

}  // namespace

std::unique_ptr<RecordingFile> open_mcap(const std::filesystem::path& path,
                                         const RecordingLimits& limits) {
  return std::make_unique<McapFile>(path, limits);
}

}  // namespace panonav::recordings
