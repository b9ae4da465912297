#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::recordings {

/// True if it names a live source of pictures: "-" (JPEG pictures that follow each other on
/// standard input), a camera (/dev/video0), or an address that the program ffmpeg opens: rtsp://,
/// rtmp://, http://, https://, tcp:// or udp://.
[[nodiscard]] bool is_live(const std::string& address);

/// A picture as it came, and when.
struct LivePicture {
  Image picture;                      ///< decoded and upright
  std::vector<std::uint8_t> encoded;  ///< the JPEG it was decoded from; empty where it was none
  /// When it arrived, in seconds since 1970-01-01 UTC; from a camera: when it was taken.
  double stamp_s = 0.0;
  /// The same moment by the clock that is never set.
  std::chrono::steady_clock::time_point arrived{};
  std::chrono::steady_clock::duration decoding{};  ///< how long it took, where we do it
};

/// Options for reading a live source.
struct LiveOptions {
  /// Size requested from a camera, which may give its nearest. Empty: the camera's setting.
  std::optional<ImageSize> size;
  double reopen_after_s = 1.0;  ///< until a source that broke off is opened again
  ImageLimits limits;           ///< of each picture; those beyond count as damaged
};

/// Pictures of a source that does not wait. A thread takes them as they come, and `next` gives the
/// newest; those between are dropped and counted. Standard input waits instead, and nothing of it
/// is dropped. A camera or address that breaks off is opened again until `stop`. Pictures that
/// cannot be decoded are counted as damaged. Memory: two pictures, packed or not.
class LivePictures {
 public:
  /// Waits for an address's first picture. Throws FileError: not live, or a camera or address that
  /// cannot be opened at first.
  explicit LivePictures(std::string address, const LiveOptions& options = {});
  ~LivePictures();
  LivePictures(const LivePictures&) = delete;
  LivePictures& operator=(const LivePictures&) = delete;

  /// Waits for a picture. Empty at the end of standard input and after `stop`. One thread at a
  /// time.
  [[nodiscard]] std::optional<LivePicture> next();
  /// `next` gives nothing more. Any thread may call.
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

/// One way in which a camera delivers pictures.
struct CameraFormat {
  std::string pixels;            ///< "MJPG", "YUYV", "GREY", ...: the driver's name
  bool usable = false;           ///< MJPG, JPEG, YUYV, UYVY and GREY are
  std::vector<ImageSize> sizes;  ///< empty: the driver does not list them
};

/// Lists the formats and sizes that a camera (V4L2) offers. Throws FileError when there is none.
[[nodiscard]] std::vector<CameraFormat> camera_formats(const std::filesystem::path& device);

}  // namespace panonav::recordings
