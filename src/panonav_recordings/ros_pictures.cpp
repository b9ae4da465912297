#include <algorithm>
#include <array>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings::ros {

namespace {

using Row = const std::uint8_t*;

/// An encoding of pixels of `bytes` bytes; `order` has the channels that are red, green and blue.
struct Encoding {
  std::string_view name;
  int bytes;
  enum class Kind { interleaved, deep, bayer, yuv } kind;
  std::array<int, 3> order;  // bayer: column and row of red in the 2 x 2 pattern; yuv: of y, u, v
};

constexpr std::array encodings{
    Encoding{"mono8", 1, Encoding::Kind::interleaved, {}},
    Encoding{"8UC1", 1, Encoding::Kind::interleaved, {}},
    Encoding{"mono16", 2, Encoding::Kind::deep, {}},
    Encoding{"rgb8", 3, Encoding::Kind::interleaved, {0, 1, 2}},
    Encoding{"bgr8", 3, Encoding::Kind::interleaved, {2, 1, 0}},
    Encoding{"8UC3", 3, Encoding::Kind::interleaved, {2, 1, 0}},
    Encoding{"rgba8", 4, Encoding::Kind::interleaved, {0, 1, 2}},
    Encoding{"bgra8", 4, Encoding::Kind::interleaved, {2, 1, 0}},
    Encoding{"8UC4", 4, Encoding::Kind::interleaved, {2, 1, 0}},
    Encoding{"bayer_rggb8", 1, Encoding::Kind::bayer, {0, 0}},
    Encoding{"bayer_bggr8", 1, Encoding::Kind::bayer, {1, 1}},
    Encoding{"bayer_gbrg8", 1, Encoding::Kind::bayer, {0, 1}},
    Encoding{"bayer_grbg8", 1, Encoding::Kind::bayer, {1, 0}},
    Encoding{"yuv422", 2, Encoding::Kind::yuv, {1, 0, 2}},
    Encoding{"uyvy", 2, Encoding::Kind::yuv, {1, 0, 2}},
    Encoding{"yuv422_yuy2", 2, Encoding::Kind::yuv, {0, 1, 3}},
    Encoding{"yuyv", 2, Encoding::Kind::yuv, {0, 1, 3}},
};

[[noreturn]] void fail(std::string_view field, std::string_view value, std::string_view allowed) {
  throw ContractError("sensor_msgs/Image " + std::string(field), to_readable_line(value), allowed);
}

std::uint8_t clamp_to_byte(int value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0, 255));
}

void convert_interleaved_row(Row row, const Encoding& from, int width, int channels,
                             std::uint8_t* to) {
  for (int u = 0; u < width; ++u) {
    for (int c = 0; c < channels; ++c) {
      *to++ = row[u * from.bytes + from.order[static_cast<std::size_t>(c)]];
    }
  }
}

void convert_deep_row(Row row, bool big_endian, int width, std::uint8_t* to) {
  for (int u = 0; u < width; ++u) {
    const int value = row[2 * u + (big_endian ? 0 : 1)] << 8 | row[2 * u + (big_endian ? 1 : 0)];
    *to++ = static_cast<std::uint8_t>((value * 255 + 32895) >> 16);  // as libpng rounds
  }
}

// Converts YUV 4:2:2 by ITU-R BT.601, with coefficients in 1/256.
void convert_yuv_row(Row row, const Encoding& from, int width, std::uint8_t* to) {
  for (int u = 0; u < width; ++u) {
    const Row pair = row + 4 * (u / 2);
    const int y = 298 * (pair[from.order[0] + 2 * (u % 2)] - 16) + 128;
    const int blue = pair[from.order[1]] - 128;
    const int red = pair[from.order[2]] - 128;
    *to++ = clamp_to_byte((y + 409 * red) >> 8);
    *to++ = clamp_to_byte((y - 100 * blue - 208 * red) >> 8);
    *to++ = clamp_to_byte((y + 516 * blue) >> 8);
  }
}

/// Interpolates a Bayer pattern: a missing colour is the mean of the two or four nearest pixels of
/// that colour. The picture is mirrored at its edges, which keeps the pattern.
void convert_bayer(const Image& message, Row data, const Encoding& from, panonav::Image& picture) {
  const int width = picture.width();
  const int height = picture.height();
  if (width < 2 || height < 2) {
    fail("size", std::to_string(width) + " x " + std::to_string(height),
         "2 x 2 or more for a Bayer pattern");
  }
  for (int v = 0; v < height; ++v) {
    const auto row = [&](int of) { return data + static_cast<std::size_t>(of) * message.step; };
    const Row here = row(v);
    const Row above = row(v > 0 ? v - 1 : 1);
    const Row below = row(v + 1 < height ? v + 1 : height - 2);
    const bool red_row = v % 2 == from.order[1];
    for (int u = 0; u < width; ++u) {
      const int left = u > 0 ? u - 1 : 1;
      const int right = u + 1 < width ? u + 1 : width - 2;
      const int across = here[left] + here[right];
      const int along = above[u] + below[u];
      const bool red_column = u % 2 == from.order[0];
      std::uint8_t* to = &picture.at(u, v);
      const auto rounded = [](int sum, int count) {
        return static_cast<std::uint8_t>((sum + count / 2) / count);
      };
      if (red_row == red_column) {  // red or blue is measured here
        const int corners = above[left] + above[right] + below[left] + below[right];
        to[red_row ? 0 : 2] = here[u];
        to[1] = rounded(across + along, 4);
        to[red_row ? 2 : 0] = rounded(corners, 4);
      } else {
        to[red_row ? 0 : 2] = rounded(across, 2);
        to[1] = here[u];
        to[red_row ? 2 : 0] = rounded(along, 2);
      }
    }
  }
}

}  // namespace

panonav::Image to_image(const Image& message, const ImageLimits& limits) {
  const auto found = std::ranges::find(encodings, message.encoding, &Encoding::name);
  if (found == encodings.end()) {
    std::string known;
    for (const auto& each : encodings)
      known += (known.empty() ? "" : ", ") + std::string(each.name);
    fail("encoding", message.encoding, known);
  }
  const std::uint64_t width = message.width;
  const std::uint64_t height = message.height;
  const auto side = static_cast<std::uint64_t>(limits.side_px);
  if (width < 1 || height < 1 || width > side || height > side ||
      width * height > static_cast<std::uint64_t>(limits.area_px)) {
    fail("size", std::to_string(width) + " x " + std::to_string(height),
         "1 .. " + std::to_string(side) + " px a side and at most " +
             std::to_string(limits.area_px) + " px in all");
  }
  const bool pairs = found->kind == Encoding::Kind::yuv;
  if (pairs && width % 2 != 0) fail("width", std::to_string(width), "even for YUV 4:2:2");
  const std::uint64_t row_bytes = width * static_cast<std::uint64_t>(found->bytes);
  if (message.step < row_bytes) {
    fail("step", std::to_string(message.step),
         "at least " + std::to_string(row_bytes) + " for " + std::to_string(width) + " px of " +
             message.encoding);
  }
  if (message.data.size() != height * message.step) {
    fail("data", std::to_string(message.data.size()) + " bytes",
         std::to_string(height * message.step) + ", height x step");
  }
  const bool grey = found->kind == Encoding::Kind::deep ||
                    (found->kind == Encoding::Kind::interleaved && found->bytes == 1);
  panonav::Image picture(static_cast<int>(width), static_cast<int>(height), grey ? 1 : 3);
  const Row data = message.data.data();
  if (found->kind == Encoding::Kind::bayer) {
    convert_bayer(message, data, *found, picture);
    return picture;
  }
  for (int v = 0; v < picture.height(); ++v) {
    const Row row = data + static_cast<std::size_t>(v) * message.step;
    std::uint8_t* to = &picture.at(0, v);
    if (found->kind == Encoding::Kind::deep) {
      convert_deep_row(row, message.is_bigendian != 0, picture.width(), to);
    } else if (found->kind == Encoding::Kind::yuv) {
      convert_yuv_row(row, *found, picture.width(), to);
    } else {
      convert_interleaved_row(row, *found, picture.width(), picture.channels(), to);
    }
  }
  return picture;
}

panonav::Image to_image(const CompressedImage& message, std::string_view name,
                        const ImageLimits& limits) {
  const std::string format = to_lower_case(message.format);
  const auto says = [&](std::string_view word) { return format.find(word) != std::string::npos; };
  const bool known = format.empty() || says("jpeg") || says("jpg") || says("png");
  if (!known || says("compresseddepth")) {
    throw ContractError("sensor_msgs/CompressedImage format", to_readable_line(message.format),
                        "jpeg, png, or such as 'rgb8; jpeg compressed bgr8'");
  }
  return decode_image(message.data, name, limits);
}

}  // namespace panonav::recordings::ros
