#include "panonav_recordings/video_file.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/internal/child_process.hpp"
#include "panonav_recordings/internal/decoded_video.hpp"

namespace panonav::recordings {

namespace {

namespace fs = std::filesystem;

/// Stamps of the images, in the time unit of the file.
struct VideoIndex {
  double unit_s = 0.0;
  std::vector<std::int64_t> stamps;  ///< ascending
};

/// Runs a program to its end and returns its standard output.
std::string run_and_read_output(const std::vector<std::string>& arguments,
                                const std::string& file) {
  constexpr std::size_t max_bytes = std::size_t{256} << 20;
  const auto child = start_ffmpeg(arguments, file);
  std::string text;
  std::string errors;
  std::array<pollfd, 2> pipes{pollfd{child->output(), POLLIN, 0},
                              pollfd{child->errors(), POLLIN, 0}};
  while (pipes[0].fd >= 0 || pipes[1].fd >= 0) {
    if (poll(pipes.data(), pipes.size(), -1) < 0) continue;
    for (auto& pipe : pipes) {
      if (pipe.fd < 0 || pipe.revents == 0) continue;
      std::array<char, 65536> buffer;
      const auto got = read(pipe.fd, buffer.data(), buffer.size());
      if (got <= 0) {
        pipe.fd = -1;
      } else if (pipe.fd == child->output()) {
        text.append(buffer.data(), static_cast<std::size_t>(got));
      } else if (errors.size() < buffer.size()) {
        errors.append(buffer.data(), static_cast<std::size_t>(got));
      }
    }
    if (text.size() > max_bytes) throw FileError(file, "has more images than can be listed");
  }
  if (child->wait() != 0) {
    while (errors.ends_with('\n')) errors.pop_back();
    const auto line = errors.rfind('\n');
    throw FileError(file, "is not a video that ffmpeg can read: " +
                              to_readable_line(errors.substr(line == errors.npos ? 0 : line + 1)));
  }
  return text;
}

std::vector<std::string> parse_fields(std::string_view line) {
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

std::optional<std::int64_t> parse_whole_number(std::string_view text) {
  std::int64_t value = 0;
  return read_number(text, value) ? std::optional(value) : std::nullopt;
}

/// Lists stamps by ffprobe; `entries` selects those of packets or of decoded frames. `nullopt` if
/// one has no stamp.
std::optional<VideoIndex> read_index(const std::string& file, const std::string& entries) {
  const std::string text = run_and_read_output(
      {"ffprobe", "-v", "error", "-protocol_whitelist", "file,pipe", "-select_streams", "v:0",
       "-show_entries", "stream=time_base:" + entries, "-of", "csv", "file:" + file},
      file);
  VideoIndex index;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const auto fields = parse_fields(std::string_view(text).substr(begin, end - begin));
    begin = end + 1;
    if (fields.size() < 2) continue;
    if (fields[0] == "stream") {
      const auto slash = fields[1].find('/');
      const auto numerator = parse_whole_number(fields[1].substr(0, slash));
      const auto denominator = slash == std::string::npos
                                   ? std::nullopt
                                   : parse_whole_number(fields[1].substr(slash + 1));
      if (!numerator || !denominator || *numerator <= 0 || *denominator <= 0) {
        throw FileError(file, "has no unit of time");
      }
      index.unit_s = static_cast<double>(*numerator) / static_cast<double>(*denominator);
    } else {
      if (fields.size() > 2 && fields[2].find('D') != std::string::npos) continue;  // not shown
      const auto stamp = parse_whole_number(fields[1]);
      if (!stamp) return std::nullopt;
      index.stamps.push_back(*stamp);
    }
  }
  if (index.stamps.empty() || index.unit_s <= 0.0) {
    throw FileError(file, "contains no image; allowed: a video");
  }
  std::ranges::sort(index.stamps);
  index.stamps.erase(std::unique(index.stamps.begin(), index.stamps.end()), index.stamps.end());
  return index;
}

class VideoStore final : public PictureStore {
 public:
  /// `chosen` has the stamps of the selected pictures.
  VideoStore(std::string file, VideoIndex chosen, std::optional<double> every_s, ImageLimits limits)
      : file_(std::move(file)), chosen_(std::move(chosen)), every_s_(every_s), limits_(limits) {}

  [[nodiscard]] Image read(std::size_t number) const override {
    const std::lock_guard lock(mutex_);
    const std::int64_t stamp_to_find = chosen_.stamps.at(number);
    if (const auto kept = kept_pictures_.find(stamp_to_find); kept != kept_pictures_.end()) {
      Image picture = std::move(kept->second);
      kept_pictures_.erase(kept);
      return picture;
    }
    if (frames_ && stamp_to_find > last_) {
      if (auto picture = decode_up_to(stamp_to_find)) return std::move(*picture);
    }
    // Seeking can fail in cut files; the second pass decodes from the beginning.
    for (const bool sought : {true, false}) {
      if (!sought && number == 0) continue;
      start_decoding(number, sought);
      if (auto picture = decode_up_to(stamp_to_find)) return std::move(*picture);
    }
    const std::string why = frames_->last_error();
    frames_.reset();
    throw FileError(file_, "the image at " + format_number(seconds(stamp_to_find)) +
                               " s cannot be decoded" +
                               (why.empty() ? "" : ": " + to_readable_line(why)));
  }

 private:
  [[nodiscard]] double seconds(std::int64_t stamp) const {
    return static_cast<double>(stamp) * chosen_.unit_s;
  }

  [[nodiscard]] std::optional<Image> decode_up_to(std::int64_t stamp_to_find) const {
    while (auto frame = frames_->next()) {
      last_ = frame->stamp;
      if (frame->stamp == stamp_to_find) return std::move(frame->picture);
      if (frame->stamp > stamp_to_find) break;
      if (std::ranges::binary_search(chosen_.stamps, frame->stamp))
        keep_for_later(std::move(*frame));
    }
    return std::nullopt;
  }

  /// Starts ffmpeg at a picture. It converts and sends only the selected pictures from there on.
  void start_decoding(std::size_t number, bool sought) const {
    const double first_s = seconds(chosen_.stamps[number]);
    constexpr double rounding_s = 1e-4;
    std::string select_expression = "gte(t," + to_text(first_s - rounding_s) + ")";
    if (every_s_) {
      select_expression += "*(isnan(prev_selected_t)+gte(t-prev_selected_t," +
                           to_text(*every_s_ - rounding_s) + "))";
    }
    std::vector<std::string> input{"-copyts"};
    if (sought && number > 0) {
      for (const std::string& word : {std::string("-seek_timestamp"), std::string("1"),
                                      std::string("-ss"), to_text(first_s - 0.5)}) {
        input.push_back(word);
      }
    }
    for (const std::string& word : {std::string("-protocol_whitelist"), std::string("file,pipe"),
                                    std::string("-i"), "file:" + file_}) {
      input.push_back(word);
    }
    kept_pictures_.clear();
    frames_.emplace(input, select_expression, file_, limits_);
    last_ = std::numeric_limits<std::int64_t>::min();
  }

  /// Keeps a decoded picture, because threads request pictures slightly out of order.
  void keep_for_later(DecodedFrame&& frame) const {
    constexpr std::size_t max_bytes = std::size_t{256} << 20;
    constexpr std::size_t max_pictures = 32;
    const std::size_t max_kept =
        std::clamp<std::size_t>(max_bytes / frame.picture.pixels().size(), 2, max_pictures);
    kept_pictures_.emplace(frame.stamp, std::move(frame.picture));
    while (kept_pictures_.size() > max_kept) kept_pictures_.erase(kept_pictures_.begin());
  }

  std::string file_;
  VideoIndex chosen_;
  std::optional<double> every_s_;
  ImageLimits limits_;
  mutable std::mutex mutex_;
  mutable std::optional<DecodedVideo> frames_;
  mutable std::int64_t last_ = 0;
  mutable std::map<std::int64_t, Image> kept_pictures_;
};

}  // namespace

bool is_video(const fs::path& file) {
  const std::string name = to_lower_case(file.extension().string());
  constexpr std::array<std::string_view, 6> known{".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi"};
  return std::ranges::find(known, name) != known.end();
}

Dataset read_video(const fs::path& file, PictureSource source, const Dataset::Selection& selection,
                   const ImageLimits& limits) {
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    throw FileError(file.string(), "does not exist; allowed: a video");
  auto index = read_index(file.string(), "packet=pts,flags");
  if (!index) index = read_index(file.string(), "frame=best_effort_timestamp");
  if (!index) throw FileError(file.string(), "has images without a time");

  Dataset dataset{file, std::move(source), {}, {}};
  for (const std::int64_t stamp : index->stamps) {
    DatasetEntry entry;
    entry.stamp_s = static_cast<double>(stamp) * index->unit_s;
    entry.file = file.filename().string() + "@" + format_fixed(*entry.stamp_s, 6);
    entry.path = file;
    entry.store_index = dataset.entries.size();
    dataset.entries.push_back(std::move(entry));
  }
  select_pictures(dataset, selection);
  VideoIndex chosen{index->unit_s, {}};
  for (auto& entry : dataset.entries) {
    chosen.stamps.push_back(index->stamps[entry.store_index]);
    entry.store_index = chosen.stamps.size() - 1;
  }
  const auto store = std::make_shared<const VideoStore>(file.string(), std::move(chosen),
                                                        selection.every_s, limits);
  for (auto& entry : dataset.entries) entry.store = store;
  return dataset;
}

}  // namespace panonav::recordings
