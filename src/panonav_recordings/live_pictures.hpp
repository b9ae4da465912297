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
  std::vector<std::uint8_t> encoded;  ///< the JPEG file, if it has all its tables; else empty
  /// Exposure time reported by a camera, otherwise time of arrival, in seconds since 1970-01-01
  /// UTC.
  double stamp_s = 0.0;
  /// The same time on the steady clock.
  std::chrono::steady_clock::time_point arrived{};
  std::chrono::steady_clock::duration decoding{};  ///< 0 if ffmpeg decoded
};

/// Options for reading a live source.
struct LiveOptions {
  /// Image size requested from a camera, which may choose the nearest that it supports. Empty: the
  /// camera's present setting.
  std::optional<ImageSize> size;
  double reopen_after_s = 1.0;  ///< pause before a lost source is opened again
  /// An address that sends no image for this time is lost. Its first image may take three times as
  /// long.
  double max_silence_s = 5.0;
  /// Called by `next` with a message when the source is lost, and when its images come again.
  std::function<void(const std::string& line)> note;
  ImageLimits limits;  ///< larger pictures are counted as damaged
};

/// Reads pictures of a live source, which does not wait for its reader. A thread receives them, and
/// `next` returns the newest; older ones are dropped and counted. Standard input is the exception:
/// it waits, and none of its pictures is dropped. A camera or address that is lost or silent is
/// opened again until `stop`. Pictures that cannot be decoded are counted as damaged. Memory: two
/// pictures, encoded or decoded.
class LivePictures {
 public:
  /// Opens the source, and waits for the first picture of an address. Throws FileError if it is not
  /// live or cannot be opened.
  explicit LivePictures(std::string address, const LiveOptions& options = {});
  ~LivePictures();
  LivePictures(const LivePictures&) = delete;
  LivePictures& operator=(const LivePictures&) = delete;

  /// Waits for a picture and returns it; empty at the end of standard input and after `stop`. Only
  /// one thread may call at a time.
  [[nodiscard]] std::optional<LivePicture> next();
  /// Makes `next` return empty, now and later. Any thread may call.
  void stop() noexcept;

  /// Numbers of lost pictures and of interruptions.
  struct Counts {
    std::uint64_t dropped = 0;        ///< pictures lost after the first call of `next`
    std::uint64_t damaged = 0;        ///< pictures that could not be decoded
    std::uint64_t interruptions = 0;  ///< times that the source was lost
    friend bool operator==(const Counts&, const Counts&) = default;
  };
  /// Returns the counts so far. Any thread may call.
  [[nodiscard]] Counts counts() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// A pixel format of a camera, with its sizes.
struct CameraFormat {
  std::string pixels;            ///< "MJPG", "YUYV", "GREY", ...: the driver's name
  bool is_supported = false;     ///< true if we can decode it
  std::vector<ImageSize> sizes;  ///< empty: the driver does not list them
};

/// Lists the formats and sizes that a camera (V4L2) offers. Throws FileError if the device is no
/// camera.
[[nodiscard]] std::vector<CameraFormat> list_camera_formats(const std::filesystem::path& device);

}  // namespace panonav::recordings
