#include "panonav_recordings/recording.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/internal/recording_file.hpp"
#include "panonav_recordings/internal/rosbag2.hpp"

namespace panonav::recordings {

namespace {

namespace fs = std::filesystem;

using Files = std::vector<std::unique_ptr<const RecordingFile>>;

bool is_earlier(const MessageLocation& a, const MessageLocation& b) {
  return std::tie(a.time_ns, a.file, a.block, a.offset) <
         std::tie(b.time_ns, b.file, b.block, b.offset);
}

class FilesRecording : public Recording {
 public:
  FilesRecording(Files files, std::vector<std::string> warnings, const RecordingLimits& limits)
      : files_(std::move(files)), warnings_(std::move(warnings)), limits_(limits) {
    std::map<std::tuple<std::string, std::string, MessageEncoding>, std::uint32_t> numbers;
    for (std::uint32_t file = 0; file < files_.size(); ++file) {
      auto& topics = topics_of_files_.emplace_back();
      for (const RecordedTopic& topic : files_[file]->topics()) {
        const auto [found, is_new] = numbers.try_emplace(
            {topic.name, topic.type, topic.encoding}, static_cast<std::uint32_t>(topics_.size()));
        if (is_new) topics_.emplace_back(topic).messages = 0;
        topics_[found->second].messages += topic.messages;
        topics.push_back(found->second);
      }
      const auto times = files_[file]->blocks();
      for (std::uint64_t block = 0; block < times.size(); ++block) {
        if (times[block]) blocks_.push_back({*times[block], file, block});
      }
    }
    std::ranges::stable_sort(blocks_, {}, [](const Block& block) { return block.time.begin_ns; });
    for (const Block& block : blocks_) {
      if (!time_) time_ = block.time;
      time_->begin_ns = std::min(time_->begin_ns, block.time.begin_ns);
      time_->end_ns = std::max(time_->end_ns, block.time.end_ns);
    }
  }

  [[nodiscard]] const std::vector<RecordedTopic>& topics() const noexcept override {
    return topics_;
  }
  [[nodiscard]] std::optional<TimeSpan> time() const noexcept override { return time_; }

  [[nodiscard]] std::vector<std::string> warnings() const override {
    auto lines = warnings_;
    for (const auto& file : files_) {
      const auto more = file->warnings();
      lines.insert(lines.end(), more.begin(), more.end());
    }
    return lines;
  }

  [[nodiscard]] std::vector<MessageLocation> locations(
      std::span<const std::uint32_t> topics, std::optional<TimeSpan> within) const override {
    const Filter filter = make_filter(topics, within);
    std::vector<MessageLocation> locations;
    for (const Block& block : blocks_) list(block, filter, locations);
    std::ranges::sort(locations, is_earlier);
    return locations;
  }

  [[nodiscard]] std::vector<std::uint8_t> read(const MessageLocation& location) const override {
    const RecordedMessage message = read_message_at(location);
    return {message.bytes.begin(), message.bytes.end()};
  }

  void for_each(std::span<const std::uint32_t> topics, std::optional<TimeSpan> within,
                const std::function<void(const MessageLocation&, std::span<const std::uint8_t>)>&
                    use) const override {
    const Filter filter = make_filter(topics, within);
    // Messages of a block that are still to be passed on. A block is opened when the time reaches
    // its first message.
    struct OpenBlock {
      std::vector<MessageLocation> locations;
      std::size_t next = 0;
    };
    const auto is_later = [](const OpenBlock& a, const OpenBlock& b) {
      return is_earlier(b.locations[b.next], a.locations[a.next]);
    };
    std::vector<OpenBlock> open;
    std::size_t listed = 0;
    std::size_t next = 0;
    std::set<std::pair<std::uint32_t, std::uint64_t>> damaged;
    while (true) {
      while (next < blocks_.size() &&
             (open.empty() ||
              blocks_[next].time.begin_ns <= open.front().locations[open.front().next].time_ns)) {
        OpenBlock block;
        list(blocks_[next++], filter, block.locations, listed);
        if (block.locations.empty()) continue;
        listed += block.locations.size();
        std::ranges::sort(block.locations, is_earlier);
        open.push_back(std::move(block));
        std::ranges::push_heap(open, is_later);
      }
      if (open.empty()) return;
      std::ranges::pop_heap(open, is_later);
      OpenBlock& first = open.back();
      const MessageLocation location = first.locations[first.next++];
      if (first.next == first.locations.size()) {
        listed -= first.locations.size();
        open.pop_back();
      } else {
        std::ranges::push_heap(open, is_later);
      }
      if (damaged.contains({location.file, location.block})) continue;
      std::optional<RecordedMessage> message;
      try {
        message = read_message_at(location);
      } catch (const FileError& error) {
        files_[location.file]->warn(error);
        damaged.emplace(location.file, location.block);
        continue;
      }
      use(location, message->bytes);
    }
  }

 private:
  struct Block {
    TimeSpan time;
    std::uint32_t file;
    std::uint64_t block;
  };
  struct Filter {
    std::vector<std::vector<bool>> topics;  ///< of each file
    TimeSpan within;
  };

  [[nodiscard]] Filter make_filter(std::span<const std::uint32_t> topics,
                                   std::optional<TimeSpan> within) const {
    constexpr TimeSpan all_times{std::numeric_limits<std::int64_t>::min(),
                                 std::numeric_limits<std::int64_t>::max()};
    std::vector<bool> chosen(topics_.size());
    for (const std::uint32_t topic : topics) {
      require(topic < topics_.size(), "topic", topic,
              "less than " + std::to_string(topics_.size()));
      chosen[topic] = true;
    }
    Filter filter{{}, within.value_or(all_times)};
    for (const auto& of_file : topics_of_files_) {
      auto& flags = filter.topics.emplace_back();
      for (const std::uint32_t topic : of_file) flags.push_back(chosen[topic]);
    }
    return filter;
  }

  // Appends the locations in a block that pass the filter. `listed` is the number of locations held
  // elsewhere, for the limit.
  void list(const Block& block, const Filter& filter, std::vector<MessageLocation>& locations,
            std::size_t listed = 0) const {
    if (block.time.begin_ns > filter.within.end_ns || block.time.end_ns < filter.within.begin_ns) {
      return;
    }
    const std::size_t before = locations.size();
    try {
      files_[block.file]->list(block.block, filter.topics[block.file], filter.within,
                               limits_.messages - std::min(listed, limits_.messages), locations);
    } catch (const FileError& error) {
      if (locations.size() + listed > limits_.messages) throw;
      files_[block.file]->warn(error);
    }
    for (std::size_t i = before; i < locations.size(); ++i) {
      locations[i].topic = topics_of_files_[block.file][locations[i].topic];
      locations[i].file = block.file;
    }
  }

  [[nodiscard]] RecordedMessage read_message_at(const MessageLocation& location) const {
    require(location.file < files_.size(), "file of a message", location.file,
            "less than " + std::to_string(files_.size()));
    const RecordingFile& file = *files_[location.file];
    RecordedMessage message = file.read(location);
    if (message.time_ns != location.time_ns ||
        topics_of_files_[location.file][message.topic] != location.topic) {
      throw FileError(file.path().string(),
                      "is damaged: an index names another message than the "
                      "one that is there");
    }
    // rosbag2 can pack each message with Zstandard, whose magic number differs from CDR in the
    // first byte, which is 0 there.
    constexpr std::array<std::uint8_t, 4> zstd_magic{0x28, 0xB5, 0x2F, 0xFD};
    if (topics_[location.topic].encoding == MessageEncoding::cdr && message.bytes.size() >= 4 &&
        std::ranges::equal(message.bytes.first(4), zstd_magic)) {
      auto unpacked = unpack_zstd_frame(message.bytes, limits_.chunk_bytes);
      if (!unpacked.is_whole) {
        throw FileError(file.path().string(), "a packed message cannot be unpacked, or not to " +
                                                  std::to_string(limits_.chunk_bytes) + " bytes");
      }
      message.owner = std::make_shared<const Buffer>(std::move(unpacked.content));
      message.bytes = message.owner->bytes();
    }
    return message;
  }

  Files files_;
  std::vector<std::string> warnings_;
  RecordingLimits limits_;
  std::vector<std::vector<std::uint32_t>> topics_of_files_;
  std::vector<RecordedTopic> topics_;
  std::vector<Block> blocks_;  // sorted by their first time
  std::optional<TimeSpan> time_;
};

enum class FileKind { other, mcap, bag, old_bag, database, packed };

FileKind detect_kind(const fs::path& path) {
  std::array<char, 100> first{};
  std::error_code code;
  if (!fs::is_regular_file(path, code)) return FileKind::other;
  std::ifstream(path, std::ios::binary).read(first.data(), first.size());
  const std::string_view text(first.data(), first.size());
  if (text.starts_with(mcap_magic)) return FileKind::mcap;
  if (text.starts_with(bag_magic)) return FileKind::bag;
  if (text.starts_with("#ROSBAG V") || text.starts_with("#ROSRECORD V")) return FileKind::old_bag;
  if (text.starts_with("\x28\xB5\x2F\xFD") && path.extension() == ".zstd") return FileKind::packed;
  // SQLite files have an application id at byte 68. It is 0 in files of rosbag2, but not
  // in those of other programs, such as memory files.
  constexpr std::size_t mark_at = 68;
  if (text.starts_with(std::string_view("SQLite format 3\0", 16)) &&
      text.substr(mark_at, 4) == std::string_view("\0\0\0\0", 4)) {
    return FileKind::database;
  }
  return FileKind::other;
}

std::unique_ptr<RecordingFile> open_file(const fs::path& path, const RecordingLimits& limits);

/// Creates an empty file in the folder for temporary files; removes its name in the destructor.
class UnnamedFile {
 public:
  explicit UnnamedFile(const std::string& packed_file) {
    std::error_code error;
    std::string name = (fs::temp_directory_path(error) / "panonav_XXXXXX").string();
    const int descriptor = error ? -1 : mkstemp(name.data());
    if (descriptor < 0) throw FileError(packed_file, "cannot be unpacked: no temporary file");
    close(descriptor);
    path_ = name;
  }
  ~UnnamedFile() {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }
  UnnamedFile(const UnnamedFile&) = delete;
  UnnamedFile& operator=(const UnnamedFile&) = delete;
  [[nodiscard]] const fs::path& path() const noexcept { return path_; }

 private:
  fs::path path_;
};

/// Unpacks a compressed file and opens the copy. The name of the copy is removed at once; it stays
/// readable until it is closed.
std::unique_ptr<RecordingFile> open_packed(const fs::path& path, const RecordingLimits& limits) {
  const UnnamedFile copy(path.string());
  std::error_code unknown;
  const auto space = fs::space(copy.path().parent_path(), unknown);
  const std::uint64_t max_bytes =
      unknown ? limits.file_bytes : std::min<std::uint64_t>(limits.file_bytes, space.available / 2);
  const UnpackedFile unpacked = unpack_zstd_file(path, copy.path(), max_bytes);
  if (unpacked.exceeds_limit) {
    throw FileError(path.string(), "unpacks to more than " + std::to_string(max_bytes) +
                                       " bytes, as many as are allowed and half of what is free "
                                       "in the folder for temporary files (TMPDIR)");
  }
  std::unique_ptr<RecordingFile> file;
  try {
    file = open_file(copy.path(), limits);
  } catch (const FileError& error) {
    const std::string what = error.what();
    const std::string of_copy = copy.path().string() + ": ";
    throw FileError(path.string(), what.starts_with(of_copy) ? what.substr(of_copy.size()) : what);
  }
  file->set_reported_path(path);
  if (!unpacked.is_whole) {
    file->warn("is damaged or cut off: " + std::to_string(unpacked.bytes) + " bytes are unpacked");
  }
  return file;
}

std::unique_ptr<RecordingFile> open_file(const fs::path& path, const RecordingLimits& limits) {
  switch (detect_kind(path)) {
    case FileKind::mcap:
      return open_mcap(path, limits);
    case FileKind::bag:
      return open_ros1_bag(path, limits);
    case FileKind::old_bag:
      throw FileError(path.string(), "is a bag of an old version; allowed: 2.0 (rosbag migrate)");
    case FileKind::database:
      return open_rosbag2_database(path, limits);
    case FileKind::packed:
      return open_packed(path, limits);
    case FileKind::other:
      break;
  }
  std::error_code code;
  if (!fs::exists(path, code)) throw FileError(path.string(), "is missing");
  throw FileError(path.string(),
                  "is not a recording; allowed: MCAP files, ROS 1 bags, .db3 files of rosbag2 and "
                  "folders of rosbag2 with metadata.yaml");
}

/// Returns the recordings in a folder of a recorder that crashed before it wrote metadata.yaml, in
/// natural order of their names (_2 before _10). Empty if the folder also has pictures, or files of
/// several recordings, whose names differ in more than a number.
std::vector<fs::path> find_files_without_metadata(const fs::path& folder) {
  constexpr std::size_t max_files = 10'000;
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::vector<std::pair<std::uint64_t, fs::path>> numbered;
  std::set<std::string> names;
  std::error_code code;
  fs::directory_iterator file(folder, code);
  for (; !code && file != fs::directory_iterator() && numbered.size() < max_files;
       file.increment(code)) {
    const std::string extension = to_lower_case(file->path().extension().string());
    if (extension == ".png" || extension == ".jpg" || extension == ".jpeg") return {};
    if (file->path().filename() == "dataset.toml") return {};
    const FileKind kind = detect_kind(file->path());
    if (kind != FileKind::mcap && kind != FileKind::database && kind != FileKind::packed) continue;
    fs::path stem = file->path().stem();
    if (extension == ".zstd") stem = stem.stem();
    std::string name = stem.string();
    std::string number;
    while (!name.empty() && is_digit(name.back())) {
      number.insert(number.begin(), name.back());
      name.pop_back();
    }
    std::uint64_t value = 0;
    if (!read_number(number, value)) value = 0;
    numbered.emplace_back(value, file->path());
    names.insert(name);
  }
  if (code || names.size() > 1) return {};
  std::ranges::sort(numbered);
  std::vector<fs::path> files;
  for (auto& each : numbered) files.push_back(std::move(each.second));
  return files;
}

bool is_rosbag2_folder(const fs::path& path) {
  std::array<char, 4096> first{};
  std::error_code code;
  if (!fs::is_regular_file(path / "metadata.yaml", code)) return false;
  std::ifstream(path / "metadata.yaml", std::ios::binary).read(first.data(), first.size());
  return std::string_view(first.data(), first.size()).find("rosbag2_bagfile_information") !=
         std::string_view::npos;
}

}  // namespace

std::unique_ptr<const Recording> Recording::open(const fs::path& path,
                                                 const RecordingLimits& limits) {
  Files files;
  std::vector<std::string> warnings;
  std::error_code code;
  const bool has_metadata = is_rosbag2_folder(path);
  const bool is_folder = fs::is_directory(path, code);
  if (!has_metadata && !is_folder) {
    files.push_back(open_file(path, limits));
  } else {
    const auto found = has_metadata ? read_rosbag2_folder(path) : find_files_without_metadata(path);
    if (found.empty()) {
      throw FileError(path.string(),
                      "has no metadata.yaml and is no recording; allowed: folders of rosbag2, or "
                      "with the files of one recording (NAME_0.db3, NAME_1.db3 or .mcap)");
    }
    if (!has_metadata) {
      warnings.push_back("has no metadata.yaml, as the recorder was not closed; files read: " +
                         std::to_string(found.size()));
    }
    // If one file of a recording cannot be opened, the others are still read.
    for (const fs::path& file : found) {
      try {
        files.push_back(open_file(file, limits));
      } catch (const FileError& error) {
        warnings.emplace_back(error.what());
      }
    }
    if (files.empty())
      throw FileError(path.string(), "has no file that can be read: " + warnings.back());
  }
  return std::make_unique<const FilesRecording>(std::move(files), std::move(warnings), limits);
}

bool is_recording(const fs::path& path) noexcept {
  try {
    if (detect_kind(path) != FileKind::other || is_rosbag2_folder(path)) return true;
    std::error_code code;
    return fs::is_directory(path, code) && !find_files_without_metadata(path).empty();
  } catch (...) {
    return false;
  }
}

}  // namespace panonav::recordings
