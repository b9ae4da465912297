#include "panonav_recordings/mcap_writer.hpp"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/temporary_file.hpp"
#include "panonav_recordings/internal/mcap_records.hpp"
#include "panonav_recordings/internal/packing.hpp"
#include "panonav_recordings/internal/recording_file.hpp"

namespace panonav::recordings {

namespace {

// A byte buffer to which little-endian fields are appended.
struct Bytes : std::vector<std::uint8_t> {
  template <class Number>
  Bytes& number(Number value) {
    for (std::size_t i = 0; i < sizeof(Number); ++i) {
      push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i)));
    }
    return *this;
  }
  Bytes& raw(std::span<const std::uint8_t> bytes) {
    insert(end(), bytes.begin(), bytes.end());
    return *this;
  }
  Bytes& text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size()));
    insert(end(), text.begin(), text.end());
    return *this;
  }
  Bytes& prefixed(const Bytes& bytes) {
    return number(static_cast<std::uint32_t>(bytes.size())).raw(bytes);
  }
  Bytes& record(McapRecord kind, const Bytes& body) {
    return number(kind).number(std::uint64_t{body.size()}).raw(body);
  }
};

std::uint32_t compute_crc(std::span<const std::uint8_t> bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(::crc32_z(before, bytes.data(), bytes.size()));
}

std::uint64_t check_time(std::int64_t time_ns) {
  require(time_ns >= 0, "time of a message", static_cast<double>(time_ns), ">= 0 nanoseconds");
  return static_cast<std::uint64_t>(time_ns);
}

}  // namespace

struct McapWriter::State {
  struct Span {
    std::uint64_t begin = 0, end = 0;
    bool is_empty = true;
    void add(std::uint64_t time) {
      begin = is_empty ? time : std::min(begin, time);
      end = is_empty ? time : std::max(end, time);
      is_empty = false;
    }
  };
  struct Channel {
    std::uint64_t messages = 0;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> in_chunk;  // times and offsets
  };

  std::filesystem::path path;
  McapWriterOptions options;
  int descriptor = -1;
  bool has_failed = false;
  std::uint64_t written = 0;
  std::uint32_t sum = 0;  // CRC-32 of all bytes written so far
  Bytes chunk;
  Span chunk_time, time;
  std::uint64_t messages = 0;
  std::vector<Channel> channels;
  std::vector<std::uint16_t> used_in_chunk;
  std::vector<std::uint8_t> packed;
  std::uint32_t schemas = 0, chunks = 0;
  // Records for the summary, by kind.
  Bytes schema_records, channel_records, chunk_indexes;

  void require_open() const {
    if (has_failed) throw FileError(path.string(), "was not written to its end");
    if (descriptor < 0) throw ContractError("recording " + path.string(), "closed", "open");
  }

  // Writes bytes; `known` is their checksum if it was computed before.
  void write_bytes(std::span<const std::uint8_t> bytes, std::optional<std::uint32_t> known = {}) {
    const std::uint32_t own = known ? *known : compute_crc(bytes);
    sum = static_cast<std::uint32_t>(::crc32_combine(sum, own, static_cast<z_off_t>(bytes.size())));
    written += bytes.size();
    while (!bytes.empty()) {
      const ssize_t count = ::write(descriptor, bytes.data(), bytes.size());
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) fail();
      bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
  }

  [[noreturn]] void fail() {
    const std::string cause = std::generic_category().message(errno);
    has_failed = true;
    close_descriptor();
    throw FileError(path.string(), "cannot be written: " + cause);
  }

  void close_descriptor() noexcept {
    if (descriptor >= 0) ::close(std::exchange(descriptor, -1));
  }

  void write_chunk() {
    if (chunk.empty()) return;
    const std::uint32_t chunk_sum = compute_crc(chunk);
    std::span<const std::uint8_t> stored = chunk;
    std::string_view name;
    if (options.compression != McapCompression::none) {
      const bool is_lz4 = options.compression == McapCompression::lz4;
      pack(chunk, is_lz4 ? Packing::lz4 : Packing::zstd, packed);
      stored = packed;
      name = is_lz4 ? "lz4" : "zstd";
    }
    const std::uint64_t at = written;
    Bytes head;
    head.number(McapRecord::chunk)
        .number(std::uint64_t{8 + 8 + 8 + 4 + 4 + name.size() + 8 + stored.size()})
        .number(chunk_time.begin)
        .number(chunk_time.end)
        .number(std::uint64_t{chunk.size()})
        .number(chunk_sum)
        .text(name)
        .number(std::uint64_t{stored.size()});
    write_bytes(head);
    write_bytes(stored, name.empty() ? std::optional(chunk_sum) : std::nullopt);

    const std::uint64_t index_at = written;
    Bytes lists, offsets;
    std::ranges::sort(used_in_chunk);
    for (const std::uint16_t number : used_in_chunk) {
      Channel& channel = channels[number];
      std::ranges::stable_sort(channel.in_chunk, {}, [](const auto& pair) { return pair.first; });
      Bytes pairs;
      for (const auto& [when, offset] : channel.in_chunk) pairs.number(when).number(offset);
      offsets.number(number).number(std::uint64_t{index_at + lists.size()});
      lists.record(McapRecord::message_index, Bytes().number(number).prefixed(pairs));
      channel.in_chunk.clear();
    }
    write_bytes(lists);
    chunk_indexes.record(McapRecord::chunk_index, Bytes()
                                                      .number(chunk_time.begin)
                                                      .number(chunk_time.end)
                                                      .number(at)
                                                      .number(std::uint64_t{index_at - at})
                                                      .prefixed(offsets)
                                                      .number(std::uint64_t{lists.size()})
                                                      .text(name)
                                                      .number(std::uint64_t{stored.size()})
                                                      .number(std::uint64_t{chunk.size()}));
    ++chunks;
    used_in_chunk.clear();
    chunk.clear();
    chunk_time = {};
  }

  void write_summary() {
    write_bytes(Bytes().record(McapRecord::data_end, Bytes().number(sum)));
    Bytes counts;
    for (std::size_t i = 0; i < channels.size(); ++i) {
      counts.number(static_cast<std::uint16_t>(i)).number(channels[i].messages);
    }
    const Bytes statistics = Bytes().record(McapRecord::statistics,
                                            Bytes()
                                                .number(messages)
                                                .number(static_cast<std::uint16_t>(schemas))
                                                .number(static_cast<std::uint32_t>(channels.size()))
                                                .number(std::uint32_t{0})  // attachments
                                                .number(std::uint32_t{0})  // metadata
                                                .number(chunks)
                                                .number(time.begin)
                                                .number(time.end)
                                                .prefixed(counts));
    const std::uint64_t start = written;
    Bytes end, offsets;
    for (const Bytes* group : std::initializer_list<const Bytes*>{&schema_records, &channel_records,
                                                                  &statistics, &chunk_indexes}) {
      if (group->empty()) continue;
      offsets.record(McapRecord::summary_offset, Bytes()
                                                     .number(group->front())
                                                     .number(start + end.size())
                                                     .number(std::uint64_t{group->size()}));
      end.raw(*group);
    }
    const std::uint64_t offsets_at = start + end.size();
    end.raw(offsets).number(McapRecord::footer).number(std::uint64_t{20});
    end.number(start).number(offsets_at);
    end.number(compute_crc(end));
    for (const char c : mcap_magic) end.push_back(static_cast<std::uint8_t>(c));
    write_bytes(end);
  }
};

McapWriter::McapWriter(const std::filesystem::path& path, const McapWriterOptions& options)
    : state_(std::make_unique<State>()) {
  state_->path = path;
  state_->options = options;
  require_no_database(path);
  constexpr int readable_by_all = 0644;
  state_->descriptor =
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, readable_by_all);
  if (state_->descriptor < 0) state_->fail();
  Bytes begin;
  for (const char c : mcap_magic) begin.push_back(static_cast<std::uint8_t>(c));
  begin.record(McapRecord::header, Bytes().text(options.profile).text("panonav"));
  state_->write_bytes(begin);
}

McapWriter::~McapWriter() {
  if (!state_) return;
  try {
    close();
  } catch (...) {
    state_->close_descriptor();
  }
}

McapWriter::McapWriter(McapWriter&&) noexcept = default;
McapWriter& McapWriter::operator=(McapWriter&& other) noexcept {
  std::swap(state_, other.state_);
  return *this;
}

std::uint16_t McapWriter::add_schema(std::string_view name, std::string_view encoding,
                                     std::string_view data) {
  State& s = *state_;
  s.require_open();
  require(s.schemas < 65535, "schemas", s.schemas + 1.0, "up to 65535");
  const auto number = static_cast<std::uint16_t>(++s.schemas);
  const Bytes record = Bytes().record(McapRecord::schema,
                                      Bytes().number(number).text(name).text(encoding).text(data));
  s.chunk.raw(record);
  s.schema_records.raw(record);
  return number;
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::string_view message_encoding,
                                      std::uint16_t schema) {
  State& s = *state_;
  s.require_open();
  require(schema <= s.schemas, "schema", schema, "up to " + std::to_string(s.schemas));
  require(s.channels.size() < 65535, "channels", static_cast<double>(s.channels.size()) + 1.0,
          "up to 65535");
  const auto number = static_cast<std::uint16_t>(s.channels.size());
  s.channels.emplace_back();
  constexpr std::uint32_t metadata_bytes = 0;
  const Bytes record = Bytes().record(McapRecord::channel, Bytes()
                                                               .number(number)
                                                               .number(schema)
                                                               .text(topic)
                                                               .text(message_encoding)
                                                               .number(metadata_bytes));
  s.chunk.raw(record);
  s.channel_records.raw(record);
  return number;
}

void McapWriter::write(std::uint16_t channel, std::int64_t log_time_ns,
                       std::int64_t publish_time_ns, std::span<const std::uint8_t> message) {
  State& s = *state_;
  s.require_open();
  require(channel < s.channels.size(), "channel", channel,
          "less than " + std::to_string(s.channels.size()));
  const std::uint64_t time = check_time(log_time_ns);
  const std::uint64_t published = check_time(publish_time_ns);
  State::Channel& used = s.channels[channel];
  if (used.in_chunk.empty()) s.used_in_chunk.push_back(channel);
  used.in_chunk.emplace_back(time, s.chunk.size());
  s.chunk.number(McapRecord::message)
      .number(std::uint64_t{2 + 4 + 8 + 8 + message.size()})
      .number(channel)
      .number(static_cast<std::uint32_t>(used.messages))
      .number(time)
      .number(published)
      .raw(message);
  s.chunk_time.add(time);
  s.time.add(time);
  ++used.messages;
  ++s.messages;
  if (s.chunk.size() >= s.options.chunk_bytes) s.write_chunk();
}

void McapWriter::flush() {
  state_->require_open();
  state_->write_chunk();
}

void McapWriter::close() {
  State& s = *state_;
  if (s.has_failed) s.require_open();
  if (s.descriptor < 0) return;
  s.write_chunk();
  s.write_summary();
  if (::fsync(s.descriptor) != 0 && errno != EINVAL && errno != EROFS && errno != ENOTSUP) s.fail();
  if (::close(std::exchange(s.descriptor, -1)) != 0) s.fail();
}

}  // namespace panonav::recordings
