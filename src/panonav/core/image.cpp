#include "panonav/core/image.hpp"

#include <cstring>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav {

Image::Image(int width, int height, int channels)
    : Image(width, height, channels,
            std::vector<std::uint8_t>(width < 1 || height < 1 || channels < 1
                                          ? 0
                                          : static_cast<std::size_t>(width) * height * channels)) {}

Image::Image(int width, int height, int channels, std::vector<std::uint8_t> pixels)
    : width_(width), height_(height), channels_(channels), pixels_(std::move(pixels)) {
  require(width >= 1, "image width", width, ">= 1");
  require(height >= 1, "image height", height, ">= 1");
  require(channels == 1 || channels == 3, "image channels", channels, "1 or 3");
  const auto expected = static_cast<std::size_t>(width) * height * channels;
  require(pixels_.size() == expected, "number of image bytes", static_cast<double>(pixels_.size()),
          to_text(static_cast<double>(expected)));
}

ImageView Image::view() const& noexcept {
  return {pixels_.data(), width_, height_, channels_,
          static_cast<std::ptrdiff_t>(width_) * channels_};
}

Image to_grey(ImageView image) {
  Image grey(image.width, image.height, 1);
  for (int v = 0; v < image.height; ++v) {
    const std::uint8_t* from = image.data + v * image.stride;
    std::uint8_t* to = &grey.at(0, v);
    if (image.channels == 1) {
      std::memcpy(to, from, static_cast<std::size_t>(image.width));
      continue;
    }
    for (int u = 0; u < image.width; ++u) {
      // Integer weights of sum 65536, so that white stays 255.
      const std::uint32_t sum =
          19595U * from[3 * u] + 38470U * from[3 * u + 1] + 7471U * from[3 * u + 2] + 32768U;
      to[u] = static_cast<std::uint8_t>(sum >> 16U);
    }
  }
  return grey;
}

}  // namespace panonav
