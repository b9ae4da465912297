#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::recordings {

/// True if the address is that of a live source of pictures: "-" (JPEG pictures that follow each
/// other on standard input), a camera (/dev/video0), or an address that the program ffmpeg opens:
/// rtsp://, rtmp://, http://, https://, tcp:// or udp://.
[[nodiscard]] bool is_live(const std::string& address);

/// A live picture and its times.
struct LivePicture {
  Image picture;                      ///< decoded and upright
  std::vector<std::uint8_t> encoded;  ///< the JPEG it was decoded from; empty if it was none
  /// Time of arrival, or from a camera of the exposure, in seconds since 1970-01-01 UTC.
  double stamp_s = 0.0;
  /// Time of the image on the monotonic clock.
  std::chrono::steady_clock::time_point arrived{};
  std::chrono::steady_clock::duration decoding{};  ///< how long it took, where we do it
};

/// Options for reading a live source.
struct LiveOptions {
  /// Size requested from a camera, which may give its nearest. Empty: the camera's setting.
  std::optional<ImageSize> size;
  double reopen_after_s = 1.0;  ///< until a source that broke off is opened again
  /// Longest silence of an address, after which it has broken off; three times as long before its
  /// first image, which may take a while.
  double max_silence_s = 5.0;
  /// Receives a line when the source has broken off, and when its images come again; `next` calls.
  std::function<void(const std::string& line)> note;
  ImageLimits limits;  ///< of each picture; those beyond count as damaged
};

/// Reads pictures of a source that does not wait. A thread receives them, and `next` returns the
/// newest; those between are dropped and counted. Standard input waits instead, and none of its
/// pictures is dropped. A camera or address that breaks off or
/// falls silent is opened again until `stop`. Pictures
/// that cannot be decoded are counted as damaged. Memory: two pictures, packed or not.
class LivePictures {
 public:
  /// Opens the source, and waits for the first picture of an address. Throws FileError if it is not
  /// live or cannot be opened.
  explicit LivePictures(std::string address, const LiveOptions& options = {});
  ~LivePictures();
  LivePictures(const LivePictures&) = delete;
  LivePictures& operator=(const LivePictures&) = delete;

  /// Waits for a picture and returns it; empty at the end of standard input and after `stop`. One
  /// thread at a time.
  [[nodiscard]] std::optional<LivePicture> next();
  /// Ends `next`, which then returns empty. Any thread may call.
  void stop() noexcept;

  /// Numbers of pictures that did not reach the caller.
  struct Counts {
    std::uint64_t dropped = 0;        ///< since the first `next`
    std::uint64_t damaged = 0;        ///< pictures that could not be decoded
    std::uint64_t interruptions = 0;  ///< times that the source broke off and was opened again
    friend bool operator==(const Counts&, const Counts&) = default;
  };
  /// Returns the losses so far. Any thread may call.
  [[nodiscard]] Counts counts() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// A pixel format of a camera, with its sizes.
struct CameraFormat {
  std::string pixels;            ///< "MJPG", "YUYV", "GREY", ...: the driver's name
  bool usable = false;           ///< MJPG, JPEG, YUYV, UYVY and GREY are
  std::vector<ImageSize> sizes;  ///< empty: the driver does not list them
};

/// Lists the formats and sizes that a camera (V4L2) offers. Throws FileError when there is none.
[[nodiscard]] std::vector<CameraFormat> list_camera_formats(const std::filesystem::path& device);

}  // namespace panonav::recordings
