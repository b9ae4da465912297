#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace panonav {

/// Width and height of an image in pixels.
struct ImageSize {
  int width = 0;   ///< columns of pixels; 0: no image
  int height = 0;  ///< rows of pixels; 0: no image
  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};

/// A view of 8-bit pixels that it does not own: `channels` interleaved (1 grey, 3 RGB), rows from
/// the top, `stride` bytes from one row to the next. Pixel (u, v) covers [u, u+1) x [v, v+1) of the
/// continuous image plane, so its centre lies at (u + 0.5, v + 0.5).
struct ImageView {
  /// The first channel of pixel (0, 0), at the upper left; null: no image.
  const std::uint8_t* data = nullptr;
  int width = 0;              ///< pixels of a row
  int height = 0;             ///< rows
  int channels = 1;           ///< bytes of a pixel: 1 grey, 3 RGB
  std::ptrdiff_t stride = 0;  ///< bytes from a row to the next, >= width * channels

  /// Width and height, without the channels.
  [[nodiscard]] ImageSize size() const noexcept { return {width, height}; }
  /// A channel of pixel (u, v), 0 .. 255. The caller guarantees that all three are within the
  /// image.
  [[nodiscard]] std::uint8_t at(int u, int v, int channel = 0) const noexcept {
    return data[v * stride + static_cast<std::ptrdiff_t>(u) * channels + channel];
  }
};

/// An 8-bit image that owns its pixels. Invariant: width, height >= 1, channels 1 or 3.
class Image {
 public:
  /// A black image. Throws ContractError.
  Image(int width, int height, int channels = 1);
  /// Throws ContractError unless pixels.size() == width * height * channels.
  Image(int width, int height, int channels, std::vector<std::uint8_t> pixels);

  [[nodiscard]] int width() const noexcept { return width_; }    ///< Pixels of a row, >= 1.
  [[nodiscard]] int height() const noexcept { return height_; }  ///< Rows, >= 1.
  /// Bytes of a pixel: 1 grey, 3 RGB.
  [[nodiscard]] int channels() const noexcept { return channels_; }
  /// Width and height, without the channels.
  [[nodiscard]] ImageSize size() const noexcept { return {width_, height_}; }
  /// All width * height * channels bytes, row-major without gaps, channels interleaved.
  [[nodiscard]] std::span<const std::uint8_t> pixels() const& noexcept { return pixels_; }
  /// Returns the pixels for writing.
  [[nodiscard]] std::span<std::uint8_t> pixels() & noexcept { return pixels_; }
  std::span<const std::uint8_t> pixels() const&& = delete;  // would dangle
  /// Returns a view of the pixels; valid as long as the image lives and is not assigned to.
  [[nodiscard]] ImageView view() const& noexcept;
  ImageView view() const&& = delete;  // would dangle

  /// A channel of pixel (u, v), 0 .. 255. The caller guarantees that all three are within the
  /// image.
  [[nodiscard]] std::uint8_t at(int u, int v, int channel = 0) const noexcept {
    return pixels_[offset(u, v, channel)];
  }
  /// Returns a pixel's channel for writing.
  [[nodiscard]] std::uint8_t& at(int u, int v, int channel = 0) noexcept {
    return pixels_[offset(u, v, channel)];
  }
  friend bool operator==(const Image&, const Image&) = default;

 private:
  [[nodiscard]] std::size_t offset(int u, int v, int channel) const noexcept {
    return (static_cast<std::size_t>(v) * width_ + u) * channels_ + channel;
  }
  int width_, height_, channels_;
  std::vector<std::uint8_t> pixels_;
};

/// Converts to one grey channel, with the weights of ITU-R BT.601 for colour (0.299 R + 0.587 G +
/// 0.114 B).
[[nodiscard]] Image to_grey(ImageView image);

}  // namespace panonav
