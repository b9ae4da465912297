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
  std::int64_t stamp = 0;  ///< in the time base of the stream
  double stamp_s = 0.0;
  Image picture;
};

/// Tracks to decode, by their numbers among those with pictures.
struct DecodedTracks {
  int track = 0;
  int right_track = -1;  ///< set to the right of `track`; -1: none
  int right_input = 0;   ///< number of the input that has `right_track`
  std::string unit;      ///< time unit of the stamps of two tracks, "1/12800"
};

/// Starts ffmpeg or ffprobe with these arguments; messages name `about`. Throws FileError that
/// names the package to install if the program is missing.
[[nodiscard]] std::unique_ptr<ChildProcess> start_ffmpeg(const std::vector<std::string>& arguments,
                                                         const std::string& about);

/// Decodes the pictures of a file or an address one after the other with the program ffmpeg.
class DecodedVideo {
 public:
  /// `input` has the arguments of ffmpeg up to and including the input. `select_expression` is an
  /// expression for its filter `select`; an empty one selects all pictures. Messages name `about`.
  /// Throws as `start_ffmpeg`.
  DecodedVideo(const std::vector<std::string>& input, const std::string& select_expression,
               std::string about, const ImageLimits& limits, const DecodedTracks& tracks = {});

  /// Returns the next picture; `nullopt` at the end. Throws FileError for pictures beyond the
  /// limits, and if no complete picture comes within `max_wait`; the program is then killed.
  [[nodiscard]] std::optional<DecodedFrame> next(
      std::optional<std::chrono::milliseconds> max_wait = {});
  /// Kills the program; a `next` that another thread is in then returns `nullopt`.
  void stop() const noexcept { child_->stop(); }
  /// Returns the last error message of ffmpeg; empty without one.
  [[nodiscard]] const std::string& last_error() const noexcept { return last_error_; }

 private:
  struct Head {
    std::int64_t stamp;
    double stamp_s;
    ImageSize size;
  };
  /// Reads from the pipe of ffmpeg's messages; false at its end.
  bool read_messages();
  /// Pipes that `wait` found to have bytes or to have ended. `wait` watches the pipe of pictures
  /// only if `for_picture`, and throws FileError after the time `until`.
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
  std::string last_error_;
  bool messages_ended_ = false;
};

}  // namespace panonav::recordings
