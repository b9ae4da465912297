#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_recordings/internal/child_process.hpp"

namespace panonav::recordings {

struct DecodedFrame {
  std::int64_t stamp = 0;  ///< in the unit of the stream
  double stamp_s = 0.0;
  Image picture;
};

/// `arguments` for ffmpeg or ffprobe. Throws FileError that names the package when there is no such
/// program.
[[nodiscard]] std::unique_ptr<ChildProcess> start_ffmpeg(const std::vector<std::string>& arguments,
                                                         const std::string& about);

/// Pictures of a file or an address, decoded one after the other by the program ffmpeg.
class DecodedVideo {
 public:
  /// `input`: ffmpeg's words up to the input. `chosen`: an expression of its filter `select`; empty
  /// takes all pictures. Messages name `about`. Throws as `start_ffmpeg`.
  DecodedVideo(const std::vector<std::string>& input, const std::string& chosen, std::string about,
               const ImageLimits& limits);

  /// Empty at the end. Throws FileError on pictures beyond the limits, and if there is no whole one
  /// within `max_wait`; then the program is ended.
  [[nodiscard]] std::optional<DecodedFrame> next(
      std::optional<std::chrono::milliseconds> max_wait = {});
  /// Ends the program; `next`, which another thread may be in, then gives nothing more.
  void stop() const noexcept { child_->stop(); }
  /// Returns the last complaint of ffmpeg; empty without one.
  [[nodiscard]] const std::string& last_error() const noexcept { return trouble_; }

 private:
  struct Head {
    std::int64_t stamp;
    double stamp_s;
    ImageSize size;
  };
  /// Reads from the pipe of messages; false at its end.
  bool read_messages();
  /// Waits until pictures (if `for_picture`) or messages have something, or ended; returns which.
  /// Throws FileError when the time is over.
  struct Ready {
    bool picture = false;
    bool messages = false;
  };
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] Ready wait(bool for_picture, const std::optional<Clock::time_point>& until) const;
  void parse_line(const std::string& line);

  std::string about_;
  ImageLimits limits_;
  std::unique_ptr<ChildProcess> child_;
  std::string line_;
  std::deque<Head> heads_;
  std::string trouble_;
  bool messages_end_ = false;
};

}  // namespace panonav::recordings
