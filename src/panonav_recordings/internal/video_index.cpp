#include "panonav_recordings/internal/video_index.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/internal/decoded_video.hpp"

namespace panonav::recordings {

namespace {

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
    if (errors.find("moov atom not found") != std::string::npos) {
      throw FileError(file,
                      "has no index (moov), because the recording was cut off before the camera "
                      "closed the file; insert the card into the camera, which may complete it, or "
                      "repair the file with the program untrunc and another video of the camera");
    }
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

/// Returns the fields of all lines of a table.
std::vector<std::vector<std::string>> parse_lines(std::string_view text) {
  std::vector<std::vector<std::string>> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(parse_fields(text.substr(begin, end - begin)));
    begin = end + 1;
  }
  return lines;
}

std::optional<std::int64_t> parse_whole_number(std::string_view text) {
  std::int64_t value = 0;
  return read_number(text, value) ? std::optional(value) : std::nullopt;
}

/// Lists stamps by ffprobe; `entries` selects those of packets or of decoded frames. `nullopt` if
/// one has no stamp.
std::optional<VideoIndex> read_index(const std::string& file, const VideoIndex& track,
                                     const std::string& entries) {
  const std::string text =
      run_and_read_output({"ffprobe", "-v", "error", "-protocol_whitelist", "file,pipe",
                           "-select_streams", "v:" + std::to_string(track.track), "-show_entries",
                           "stream=time_base:" + entries, "-of", "csv", "file:" + file},
                          file);
  VideoIndex index = track;
  for (const auto& fields : parse_lines(text)) {
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
      index.unit = fields[1];
      index.unit_s = static_cast<double>(*numerator) / static_cast<double>(*denominator);
    } else if (fields[0] == "packet" || fields[0] == "frame") {
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

/// True if the size is about square, as that of the circle of a lens.
bool is_lens_size(const ImageSize& size) {
  constexpr double max_ratio = 1.25;
  const double ratio = static_cast<double>(size.width) / size.height;
  return ratio <= max_ratio && ratio >= 1.0 / max_ratio;
}

/// Chooses the largest track, and a second one for the other lens. Attached pictures, such as
/// covers, are no tracks.
VideoIndex find_tracks(const std::string& file) {
  const std::string text = run_and_read_output(
      {"ffprobe", "-v", "error", "-protocol_whitelist", "file,pipe", "-select_streams", "v",
       "-show_entries", "stream=width,height,time_base:stream_disposition=attached_pic", "-of",
       "csv", "file:" + file},
      file);
  VideoIndex chosen;
  int number = -1;
  for (const auto& fields : parse_lines(text)) {
    if (fields.size() != 5 || fields[0] != "stream") continue;
    ++number;
    const auto width = parse_whole_number(fields[1]);
    const auto height = parse_whole_number(fields[2]);
    if (fields[4] == "1" || !width || !height || *width < 1 || *height < 1) continue;
    const ImageSize size{static_cast<int>(*width), static_cast<int>(*height)};
    if (size == chosen.size && chosen.right_track < 0) {
      chosen.right_track = number;
    } else if (double{1} * size.width * size.height >
               double{1} * chosen.size.width * chosen.size.height) {
      chosen.track = number;
      chosen.right_track = -1;
      chosen.size = size;
    }
  }
  if (chosen.right_track < 0) return chosen;
  const double ratio = static_cast<double>(chosen.size.width) / chosen.size.height;
  constexpr double min_cube_ratio = 2.5;  // three faces side by side
  if (ratio > min_cube_ratio) {
    const std::string height = std::to_string(2 * chosen.size.height);
    throw FileError(
        file,
        "has two tracks with the faces of a cube (.360 of GoPro), which cannot be read; export it "
        "as a video of 360 degree images with GoPro Player, or (a degree off at the edges of the "
        "faces): ffmpeg -i " +
            quote_for_shell(file) + " -filter_complex '[0:v:" + std::to_string(chosen.track) +
            "][0:v:" + std::to_string(chosen.right_track) + "]vstack,v360=eac:e:w=" +
            std::to_string(4 * chosen.size.height) + ":h=" + height + "' equirectangular.mp4");
  }
  if (!is_lens_size(chosen.size)) chosen.right_track = -1;
  return chosen;
}

/// Adds the track of the other lens, which is in a file of its own.
void add_right_file(VideoIndex& index, const std::string& file, const std::string& right_file) {
  const VideoIndex right = find_tracks(right_file);
  if (index.right_track >= 0 || right.right_track >= 0 || right.size != index.size ||
      !is_lens_size(right.size)) {
    throw FileError(right_file, "is not the second lens of " + file +
                                    ", although its name says so; allowed: one square track of the "
                                    "same size in each");
  }
  index.right_track = right.track;
  index.right_file = right_file;
}

}  // namespace

VideoIndex read_video_index(const std::string& file, const std::string& right_file) {
  VideoIndex track = find_tracks(file);
  if (!right_file.empty()) add_right_file(track, file, right_file);
  auto index = read_index(file, track, "packet=pts,flags");
  if (!index) index = read_index(file, track, "frame=best_effort_timestamp");
  if (!index) throw FileError(file, "has images without a time");
  return *index;
}

}  // namespace panonav::recordings
