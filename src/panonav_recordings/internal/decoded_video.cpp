#include "panonav_recordings/internal/decoded_video.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"

namespace panonav::recordings {

std::unique_ptr<ChildProcess> start_ffmpeg(const std::vector<std::string>& arguments,
                                           const std::string& about) {
  try {
    return std::make_unique<ChildProcess>(arguments);
  } catch (const Error&) {
    throw FileError(about, "videos need the program " + arguments.front() +
                               ", which cannot be started; install the package ffmpeg");
  }
}

DecodedVideo::DecodedVideo(const std::vector<std::string>& input,
                           const std::string& select_expression, std::string about,
                           const ImageLimits& limits, const DecodedTracks& tracks)
    : about_(std::move(about)), limits_(limits) {
  std::vector<std::string> arguments{"ffmpeg",   "-nostdin",  "-hide_banner",
                                     "-nostats", "-loglevel", "level+info"};
  arguments.insert(arguments.end(), input.begin(), input.end());
  // The filter showinfo writes stamp and size of a picture to standard error before its bytes
  // arrive.
  const std::string filter =
      (select_expression.empty() ? "" : "select='" + select_expression + "',") +
      std::string("format=rgb24,showinfo=checksum=0");
  const std::string left = "0:v:" + std::to_string(tracks.track);
  if (tracks.right_track < 0) {
    arguments.insert(arguments.end(), {"-map", left, "-vf", filter});
  } else {
    const std::string right =
        std::to_string(tracks.right_input) + ":v:" + std::to_string(tracks.right_track);
    arguments.insert(
        arguments.end(),
        {"-filter_complex",
         "[" + left + "][" + right + "]hstack,settb=expr=" + tracks.unit + "," + filter + "[both]",
         "-map", "[both]"});
  }
  arguments.insert(arguments.end(), {"-fps_mode", "passthrough", "-f", "rawvideo", "pipe:1"});
  child_ = start_ffmpeg(arguments, about_);
}

void DecodedVideo::parse_line(const std::string& line) {
  if (line.starts_with("[Parsed_showinfo")) {
    const auto at = line.find("] [info] n:");
    if (at == std::string::npos) return;
    // A line reads "n: 0 pts: 512 pts_time:0.04 ... s:96x12 ..."; the first occurrence of a name is
    // used.
    const auto read_field = [&](std::string_view name, auto& value) {
      const auto begin = line.find(name, at);
      if (begin == std::string::npos) return std::string_view();
      std::string_view rest = std::string_view(line).substr(begin + name.size());
      rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
      return read_leading_number(rest, value) ? rest : std::string_view();
    };
    Head head{};
    const std::string_view size = read_field(" s:", head.size.width);
    const auto x = size.find('x');
    if (x != std::string_view::npos && read_leading_number(size.substr(x + 1), head.size.height) &&
        !read_field(" pts:", head.stamp).empty() &&
        !read_field(" pts_time:", head.stamp_s).empty()) {
      heads_.push_back(head);
    }
    return;
  }
  for (const char* level : {"[error] ", "[fatal] "}) {
    if (const auto at = line.find(level); at != std::string::npos)
      last_error_ = line.substr(at + 8);
  }
}

bool DecodedVideo::read_messages() {
  std::array<char, 4096> buffer;
  const auto got = read(child_->errors(), buffer.data(), buffer.size());
  if (got <= 0) {
    messages_ended_ = true;
    return false;
  }
  constexpr std::size_t max_line = 4096;
  for (ssize_t i = 0; i < got; ++i) {
    const char c = buffer[static_cast<std::size_t>(i)];
    if (c == '\n') {
      parse_line(line_);
      line_.clear();
    } else if (line_.size() < max_line) {
      line_ += c;
    }
  }
  return true;
}

DecodedVideo::Ready DecodedVideo::wait(bool for_picture,
                                       const std::optional<Clock::time_point>& until) const {
  std::array<pollfd, 2> pipes{pollfd{for_picture ? child_->output() : -1, POLLIN, 0},
                              pollfd{messages_ended_ ? -1 : child_->errors(), POLLIN, 0}};
  int ready = -1;
  while (ready < 0) {  // repeated if a signal interrupts it
    const auto left = until ? std::chrono::ceil<std::chrono::milliseconds>(*until - Clock::now())
                            : std::chrono::milliseconds(-1);
    ready =
        poll(pipes.data(), pipes.size(), until ? std::max(0, static_cast<int>(left.count())) : -1);
  }
  if (ready == 0) {
    child_->stop();
    throw FileError(about_, "has sent no image in time");
  }
  return {pipes[0].revents != 0, pipes[1].revents != 0};
}

std::optional<DecodedFrame> DecodedVideo::next(std::optional<std::chrono::milliseconds> max_wait) {
  std::optional<Clock::time_point> until;
  if (max_wait) until = Clock::now() + *max_wait;
  while (heads_.empty()) {
    if (messages_ended_) return std::nullopt;
    static_cast<void>(wait(false, until));
    if (!read_messages()) return std::nullopt;
  }
  const Head head = heads_.front();
  heads_.pop_front();
  const auto [width, height] = head.size;
  if (width < 1 || height < 1 || width > limits_.side_px || height > limits_.side_px ||
      std::int64_t{width} * height > limits_.area_px) {
    throw FileError(about_, "its images are " + std::to_string(width) + " x " +
                                std::to_string(height) + " px; allowed: up to " +
                                std::to_string(limits_.area_px) + " px, sides up to " +
                                std::to_string(limits_.side_px));
  }
  DecodedFrame frame{head.stamp, head.stamp_s, Image(width, height, 3)};
  auto pixels = frame.picture.pixels();
  std::size_t filled = 0;
  while (filled < pixels.size()) {
    // Messages are read at the same time, because ffmpeg would block on a full pipe.
    const Ready ready = wait(true, until);
    if (ready.messages) read_messages();
    if (!ready.picture) continue;
    const auto got = read(child_->output(), pixels.data() + filled, pixels.size() - filled);
    if (got <= 0) return std::nullopt;
    filled += static_cast<std::size_t>(got);
  }
  return frame;
}

}  // namespace panonav::recordings
