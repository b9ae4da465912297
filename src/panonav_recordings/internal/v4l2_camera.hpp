#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav_recordings/live_pictures.hpp"

namespace panonav::recordings {

/// A V4L2 camera that streams into mapped buffers.
class V4l2Camera {
 public:
  /// Opens the device. Throws FileError if it is no usable camera.
  V4l2Camera(std::string device, const std::optional<ImageSize>& size);
  ~V4l2Camera();
  V4l2Camera(const V4l2Camera&) = delete;
  V4l2Camera& operator=(const V4l2Camera&) = delete;

  struct Frame {
    std::vector<std::uint8_t> bytes;
    double stamp_s = 0.0;  ///< since 1970-01-01 UTC
    std::chrono::steady_clock::time_point arrived{};
    std::uint64_t lost = 0;  ///< frames that the driver lost since the previous one
  };
  /// Waits for the next undamaged frame; `nullopt` once the descriptor `stop` is readable. Throws
  /// FileError if the camera is silent for 5 s or was disconnected.
  [[nodiscard]] std::optional<Frame> next(int stop);
  /// Decodes the bytes of a frame. Throws FileError, ContractError.
  [[nodiscard]] Image decode(std::span<const std::uint8_t> bytes, const ImageLimits& limits) const;

 private:
  void start(const std::optional<ImageSize>& size);
  [[noreturn]] void fail(const std::string& what) const;
  struct Buffer {
    void* data;
    std::size_t length;
  };
  std::string device_;
  int descriptor_ = -1;
  std::vector<Buffer> buffers_;
  std::uint32_t pixels_ = 0;
  ImageSize size_;
  std::uint32_t step_ = 0;
  std::optional<std::uint32_t> sequence_;
};

}  // namespace panonav::recordings
