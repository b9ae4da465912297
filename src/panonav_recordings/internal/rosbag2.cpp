#include "panonav_recordings/internal/rosbag2.hpp"

#include <sqlite3.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <limits>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav_recordings/internal/recording_file.hpp"

namespace panonav::recordings {

namespace {

namespace fs = std::filesystem;

// Makes an SQLite URI of the file. It is immutable (no locks), unless a write-ahead log shows that
// a recorder may still be writing.
std::string make_uri(const fs::path& path) {
  std::string uri = "file:";
  constexpr char digits[] = "0123456789ABCDEF";
  for (const char c : fs::absolute(path).string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte > 0x20 && byte < 0x7F && c != '%' && c != '?' && c != '#') {
      uri += c;
    } else {
      uri += {'%', digits[byte >> 4U], digits[byte & 15U]};
    }
  }
  std::error_code missing;
  const auto log = fs::file_size(path.string() + "-wal", missing);
  return uri + (missing || log == 0 ? "?immutable=1" : "");
}

// A .db3 file with the tables `topics` and `messages`. All messages are one block, and `offset` is
// the id of a message.
class DatabaseFile : public RecordingFile {
 public:
  DatabaseFile(const fs::path& path, const RecordingLimits& limits) : RecordingFile(path) {
    sqlite3* handle = nullptr;
    const int code = sqlite3_open_v2(
        make_uri(path).c_str(), &handle,
        SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE,
        nullptr);
    handle_.reset(handle);
    if (code != SQLITE_OK) throw_sqlite_error(code);
    // These settings keep a foreign or damaged file from running code, using much memory or never
    // ending.
    constexpr int steps_per_check = 20000;
    sqlite3_progress_handler(
        handle, steps_per_check,
        [](void* left) {
          auto& steps = *static_cast<std::int64_t*>(left);
          steps -= steps_per_check;
          return steps < 0 ? 1 : 0;
        },
        &steps_left_);
    sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    constexpr std::size_t max_blob = 1U << 30U;
    sqlite3_limit(handle, SQLITE_LIMIT_LENGTH,
                  static_cast<int>(std::min(limits.chunk_bytes, max_blob)));
    constexpr std::int64_t min_steps = 10'000'000, steps_per_byte = 12;
    std::error_code unknown;
    const auto bytes = fs::file_size(path, unknown);
    steps_allowed_ = min_steps + steps_per_byte * static_cast<std::int64_t>(unknown ? 0 : bytes);
    for (const char* pragma : {"PRAGMA cell_size_check=ON", "PRAGMA query_only=ON"}) {
      (void)step(prepare(pragma));
    }
    require_tables();
    const Statement topics =
        prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
    while (step(topics)) {
      topics_by_id_.try_emplace(
          sqlite3_column_int64(topics.get(), 0),
          get_or_create_topic(text(topics, 1), text(topics, 2), text(topics, 3)));
    }
    try {
      const Statement rows = prepare("SELECT id, topic_id, timestamp FROM messages");
      while (step(rows)) {
        const auto location = read_location(rows);
        if (!location) continue;
        ++topics_[location->topic].messages;
        if (!time_) time_ = TimeSpan{location->time_ns, location->time_ns};
        time_->begin_ns = std::min(time_->begin_ns, location->time_ns);
        time_->end_ns = std::max(time_->end_ns, location->time_ns);
      }
    } catch (const FileError& error) {
      warn(error);  // messages before the damage are used
    }
    find_statement_ = prepare("SELECT id, topic_id, timestamp, data FROM messages WHERE id = ?");
  }

  [[nodiscard]] std::vector<std::optional<TimeSpan>> blocks() const override { return {time_}; }

  void list(std::size_t, const std::vector<bool>& chosen_topics, const TimeSpan& within,
            std::size_t max_locations, std::vector<MessageLocation>& locations) const override {
    const std::lock_guard lock(mutex_);
    // The index of times is faster only if a part of the messages is read.
    const bool is_all = within.begin_ns <= time_->begin_ns && within.end_ns >= time_->end_ns;
    const Statement rows =
        prepare(is_all ? "SELECT id, topic_id, timestamp FROM messages"
                       : "SELECT id, topic_id, timestamp FROM messages WHERE timestamp "
                         "BETWEEN ? AND ?");
    if (!is_all) {
      sqlite3_bind_int64(rows.get(), 1, within.begin_ns);
      sqlite3_bind_int64(rows.get(), 2, within.end_ns);
    }
    while (step(rows)) {
      const auto location = read_location(rows);
      if (!location || !chosen_topics[location->topic]) continue;
      locations.push_back(*location);
      check_message_limit(locations.size(), max_locations);
    }
  }

  [[nodiscard]] RecordedMessage read(const MessageLocation& location) const override {
    const std::lock_guard lock(mutex_);
    const std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_reset)> rewind(find_statement_.get(),
                                                                         sqlite3_reset);
    sqlite3_bind_int64(find_statement_.get(), 1, static_cast<std::int64_t>(location.offset));
    steps_left_ = steps_allowed_;
    const auto found = step(find_statement_) ? read_location(find_statement_) : std::nullopt;
    if (!found || sqlite3_column_type(find_statement_.get(), 3) != SQLITE_BLOB) {
      fail("is damaged: message " + std::to_string(location.offset) + " is missing or no blob");
    }
    const auto* data =
        static_cast<const std::uint8_t*>(sqlite3_column_blob(find_statement_.get(), 3));
    Buffer buffer(static_cast<std::size_t>(sqlite3_column_bytes(find_statement_.get(), 3)));
    if (buffer.size > 0 && data == nullptr) fail("cannot be read: out of memory");
    std::copy_n(data, buffer.size, buffer.data.get());
    RecordedMessage message{found->time_ns, found->topic, {}, {}};
    message.owner = std::make_shared<const Buffer>(std::move(buffer));
    message.bytes = message.owner->bytes();
    return message;
  }

 private:
  struct Finalise {
    void operator()(sqlite3_stmt* statement) const noexcept { sqlite3_finalize(statement); }
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Finalise>;
  struct Close {
    void operator()(sqlite3* handle) const noexcept { sqlite3_close_v2(handle); }
  };

  [[noreturn]] void throw_sqlite_error(int code) const {
    const std::string what = handle_ ? sqlite3_errmsg(handle_.get()) : sqlite3_errstr(code);
    switch (code & 0xFF) {
      case SQLITE_CANTOPEN:
      case SQLITE_IOERR:
      case SQLITE_BUSY:
        fail("cannot be read: " + what);
      case SQLITE_INTERRUPT:
        fail("is damaged: its tables are read without end");
      default:
        fail("is damaged or no recording of rosbag2: " + what);
    }
  }

  [[nodiscard]] Statement prepare(const char* sql) const {
    steps_left_ = steps_allowed_;
    sqlite3_stmt* statement = nullptr;
    const int code = sqlite3_prepare_v2(handle_.get(), sql, -1, &statement, nullptr);
    if (code != SQLITE_OK) throw_sqlite_error(code);
    return Statement(statement);
  }

  bool step(const Statement& statement) const {
    const int code = sqlite3_step(statement.get());
    if (code != SQLITE_ROW && code != SQLITE_DONE) throw_sqlite_error(code);
    return code == SQLITE_ROW;
  }

  [[nodiscard]] std::string_view text(const Statement& row, int column) const {
    const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(row.get(), column));
    if (data == nullptr) return {};
    return {data, static_cast<std::size_t>(sqlite3_column_bytes(row.get(), column))};
  }

  // Throws FileError unless both are real tables: views run SQL of the file's author, and virtual
  // tables run modules.
  void require_tables() const {
    const Statement rows = prepare(
        "SELECT count(*) FROM sqlite_schema WHERE name IN ('topics', 'messages') AND "
        "type = 'table' AND rootpage > 0");
    if (!step(rows) || sqlite3_column_int(rows.get(), 0) != 2) {
      fail("is not a recording of rosbag2: it lacks the tables 'topics' and 'messages'");
    }
  }

  // Reads the location of a message from a row that begins with id, topic and time; `nullopt` if
  // these are no integers or the topic is unknown.
  [[nodiscard]] std::optional<MessageLocation> read_location(const Statement& row) const {
    for (int column = 0; column < 3; ++column) {
      if (sqlite3_column_type(row.get(), column) != SQLITE_INTEGER) {
        warn("messages without a time or topic are left out");
        return std::nullopt;
      }
    }
    const auto topic = topics_by_id_.find(sqlite3_column_int64(row.get(), 1));
    if (topic == topics_by_id_.end()) {
      warn("messages of topic " + std::to_string(sqlite3_column_int64(row.get(), 1)) +
           " are left out: the topic is not described");
      return std::nullopt;
    }
    MessageLocation location;
    location.time_ns = sqlite3_column_int64(row.get(), 2);
    location.topic = topic->second;
    location.offset = static_cast<std::uint64_t>(sqlite3_column_int64(row.get(), 0));
    return location;
  }

  mutable std::mutex mutex_;
  mutable std::int64_t steps_left_ = 0;
  std::int64_t steps_allowed_ = 0;
  std::unordered_map<std::int64_t, std::uint32_t> topics_by_id_;  // topics by their ids
  std::optional<TimeSpan> time_;
  std::unique_ptr<sqlite3, Close> handle_;
  Statement find_statement_;
};

}  // namespace

std::unique_ptr<RecordingFile> open_rosbag2_database(const fs::path& path,
                                                     const RecordingLimits& limits) {
  return std::make_unique<DatabaseFile>(path, limits);
}

std::vector<fs::path> read_rosbag2_folder(const fs::path& folder) {
  constexpr std::size_t max_bytes = 4U << 20U;
  const fs::path path = folder / "metadata.yaml";
  const auto bytes = read_file(path, max_bytes);
  std::vector<fs::path> files;
  try {
    const YAML::Node root = YAML::Load(std::string(bytes.begin(), bytes.end()));
    const YAML::Node list = root["rosbag2_bagfile_information"]["relative_file_paths"];
    if (!list.IsSequence() || list.size() == 0) {
      throw FileError(path.string(), "names no files (relative_file_paths)");
    }
    for (const YAML::Node& file : list) {
      // Some versions name the folder, too; files elsewhere are not of this recording.
      files.push_back(folder / fs::path(file.as<std::string>()).filename());
    }
  } catch (const YAML::Exception& error) {
    throw FileError(path.string(),
                    "is not valid metadata of rosbag2: " + to_readable_line(error.what()));
  }
  return files;
}

}  // namespace panonav::recordings
