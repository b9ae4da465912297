#include <algorithm>
#include <array>
#include <bit>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings::ros {

namespace {

using Row = const std::uint8_t*;

/// An encoding of pixels of `channels` samples of `sample_bytes` bytes.
struct Encoding {
  std::string_view name;
  int channels;
  int sample_bytes;
  enum class Kind { interleaved, bayer, yuv, planes } kind;
  /// The channels that are red, green and blue; bayer: column and row of red in the 2 x 2 pattern;
  /// yuv: positions of y, u, v; planes: columns and rows for a value of u and v, and their order.
  std::array<int, 3> order;
};

/// Orders of u and v behind the plane of y: pairs that begin with u or v, or planes.
enum PlaneOrder : int { pairs_uv, pairs_vu, planes_uv, planes_vu };

using Kind = Encoding::Kind;
constexpr std::array encodings{
    Encoding{"mono8", 1, 1, Kind::interleaved, {}},
    Encoding{"8UC1", 1, 1, Kind::interleaved, {}},
    Encoding{"mono16", 1, 2, Kind::interleaved, {}},
    Encoding{"16UC1", 1, 2, Kind::interleaved, {}},
    Encoding{"32FC1", 1, 4, Kind::interleaved, {}},
    Encoding{"rgb8", 3, 1, Kind::interleaved, {0, 1, 2}},
    Encoding{"bgr8", 3, 1, Kind::interleaved, {2, 1, 0}},
    Encoding{"8UC3", 3, 1, Kind::interleaved, {2, 1, 0}},
    Encoding{"rgba8", 4, 1, Kind::interleaved, {0, 1, 2}},
    Encoding{"bgra8", 4, 1, Kind::interleaved, {2, 1, 0}},
    Encoding{"8UC4", 4, 1, Kind::interleaved, {2, 1, 0}},
    Encoding{"rgb16", 3, 2, Kind::interleaved, {0, 1, 2}},
    Encoding{"bgr16", 3, 2, Kind::interleaved, {2, 1, 0}},
    Encoding{"16UC3", 3, 2, Kind::interleaved, {2, 1, 0}},
    Encoding{"rgba16", 4, 2, Kind::interleaved, {0, 1, 2}},
    Encoding{"bgra16", 4, 2, Kind::interleaved, {2, 1, 0}},
    Encoding{"16UC4", 4, 2, Kind::interleaved, {2, 1, 0}},
    Encoding{"bayer_rggb8", 1, 1, Kind::bayer, {0, 0}},
    Encoding{"bayer_bggr8", 1, 1, Kind::bayer, {1, 1}},
    Encoding{"bayer_gbrg8", 1, 1, Kind::bayer, {0, 1}},
    Encoding{"bayer_grbg8", 1, 1, Kind::bayer, {1, 0}},
    Encoding{"yuv422", 2, 1, Kind::yuv, {1, 0, 2}},
    Encoding{"uyvy", 2, 1, Kind::yuv, {1, 0, 2}},
    Encoding{"yuv422_yuy2", 2, 1, Kind::yuv, {0, 1, 3}},
    Encoding{"yuyv", 2, 1, Kind::yuv, {0, 1, 3}},
    Encoding{"yuy2", 2, 1, Kind::yuv, {0, 1, 3}},
    Encoding{"yvyu", 2, 1, Kind::yuv, {0, 3, 1}},
    Encoding{"nv12", 1, 1, Kind::planes, {2, 2, pairs_uv}},
    Encoding{"nv21", 1, 1, Kind::planes, {2, 2, pairs_vu}},
    Encoding{"nv24", 1, 1, Kind::planes, {1, 1, pairs_uv}},
    Encoding{"i420", 1, 1, Kind::planes, {2, 2, planes_uv}},
    Encoding{"yuv420p", 1, 1, Kind::planes, {2, 2, planes_uv}},
    Encoding{"yv12", 1, 1, Kind::planes, {2, 2, planes_vu}},
};

[[noreturn]] void fail(std::string_view field, std::string_view value, std::string_view allowed) {
  throw ContractError("sensor_msgs/Image " + std::string(field), to_readable_line(value), allowed);
}

std::uint8_t clamp_to_byte(int value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0, 255));
}

/// Reads samples of one, two or four bytes as 8 bit.
class SampleReader {
 public:
  SampleReader(const Encoding& from, bool big_endian)
      : bytes_(from.sample_bytes), big_endian_(big_endian) {}
  /// Sets the scale of floating-point samples by the largest sample of the picture.
  void scale_by(Row data, std::size_t samples) {
    constexpr float max_of_unit_range = 2.0F;  // tolerates values somewhat beyond 1
    for (std::size_t i = 0; i < samples; ++i)
      if (to_float(data + 4 * i) > max_of_unit_range) scale_ = 1.0F;
  }
  [[nodiscard]] std::uint8_t operator()(Row sample) const {
    if (bytes_ == 1) return *sample;
    if (bytes_ == 2) {
      const int value = sample[big_endian_ ? 0 : 1] << 8 | sample[big_endian_ ? 1 : 0];
      return static_cast<std::uint8_t>((value * 255 + 32895) >> 16);  // as libpng rounds
    }
    const float value = scale_ * to_float(sample);
    if (!(value > 0.0F)) return 0;  // also without a number
    return static_cast<std::uint8_t>(std::min(value, 255.0F) + 0.5F);
  }

 private:
  [[nodiscard]] float to_float(Row sample) const {
    std::uint32_t bits = 0;
    for (int i = 0; i < 4; ++i)
      bits |= std::uint32_t{sample[i]} << static_cast<unsigned>(8 * (big_endian_ ? 3 - i : i));
    return std::bit_cast<float>(bits);
  }
  int bytes_;
  bool big_endian_;
  float scale_ = 255.0F;
};

void convert_interleaved_row(Row row, const Encoding& from, const SampleReader& read, int width,
                             int channels, std::uint8_t* to) {
  for (int u = 0; u < width; ++u) {
    for (int c = 0; c < channels; ++c) {
      const int sample = u * from.channels + from.order[static_cast<std::size_t>(c)];
      *to++ = read(row + sample * from.sample_bytes);
    }
  }
}

/// Converts a pixel by ITU-R BT.601, with coefficients in 1/256.
void convert_yuv(int luma, int blue, int red, std::uint8_t* to) {
  const int y = 298 * (luma - 16) + 128;
  blue -= 128;
  red -= 128;
  to[0] = clamp_to_byte((y + 409 * red) >> 8);
  to[1] = clamp_to_byte((y - 100 * blue - 208 * red) >> 8);
  to[2] = clamp_to_byte((y + 516 * blue) >> 8);
}

void convert_yuv_row(Row row, const Encoding& from, int width, std::uint8_t* to) {
  for (int u = 0; u < width; ++u, to += 3) {
    const Row pair = row + 4 * (u / 2);
    convert_yuv(pair[from.order[0] + 2 * (u % 2)], pair[from.order[1]], pair[from.order[2]], to);
  }
}

/// Bytes of the rows of u and v behind the rows of y.
std::uint64_t count_colour_bytes(const Encoding& from, std::uint64_t step, std::uint64_t rows) {
  return 2 * step * rows / static_cast<std::uint64_t>(from.order[0] * from.order[1]);
}

/// Converts planes: y of each pixel, then u and v in pairs or planes. `data` has all of them.
void convert_planes(Row data, std::size_t step, const Encoding& from, panonav::Image& picture) {
  const auto [across, along, order] = from.order;
  const auto rows = static_cast<std::size_t>(picture.height());
  const Row colours = data + step * rows;
  const bool has_pairs = order == pairs_uv || order == pairs_vu;
  const bool is_v_first = order == pairs_vu || order == planes_vu;
  const std::size_t row_bytes = has_pairs ? 2 * step / static_cast<std::size_t>(across)
                                          : step / static_cast<std::size_t>(across);
  const std::size_t plane = row_bytes * (rows / static_cast<std::size_t>(along));
  for (int v = 0; v < picture.height(); ++v) {
    const Row luma = data + step * static_cast<std::size_t>(v);
    const Row row = colours + row_bytes * static_cast<std::size_t>(v / along);
    for (int u = 0; u < picture.width(); ++u) {
      const Row first = row + (has_pairs ? 2 : 1) * (u / across);
      const Row second = has_pairs ? first + 1 : first + plane;
      convert_yuv(luma[u], is_v_first ? *second : *first, is_v_first ? *first : *second,
                  &picture.at(u, v));
    }
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

namespace {

const Encoding& find_encoding(const std::string& name) {
  const auto found = std::ranges::find(encodings, to_lower_case(name), [](const Encoding& each) {
    return to_lower_case(each.name);
  });
  if (found != encodings.end()) return *found;
  std::string known;
  for (const auto& each : encodings) known += (known.empty() ? "" : ", ") + std::string(each.name);
  fail("encoding", name, known);
}

/// Returns the rows of the picture, which for planes can be fewer than those of the message. Throws
/// ContractError if sizes and lengths do not fit.
std::uint64_t check_layout(const Image& message, const Encoding& from, const ImageLimits& limits) {
  const std::uint64_t width = message.width;
  std::uint64_t height = message.height;
  const auto side = static_cast<std::uint64_t>(limits.side_px);
  if (width < 1 || height < 1 || width > side || height > side ||
      width * height > static_cast<std::uint64_t>(limits.area_px)) {
    fail("size", std::to_string(width) + " x " + std::to_string(height),
         "1 .. " + std::to_string(side) + " px a side and at most " +
             std::to_string(limits.area_px) + " px in all");
  }
  const std::uint64_t row_bytes =
      width * static_cast<std::uint64_t>(from.channels * from.sample_bytes);
  if (message.step < row_bytes) {
    fail("step", std::to_string(message.step),
         "at least " + std::to_string(row_bytes) + " for " + std::to_string(width) + " px of " +
             message.encoding);
  }
  const std::uint64_t step = message.step;
  std::uint64_t bytes = height * step;
  if (from.kind == Kind::planes) {
    // `height` counts the rows of y alone, or also those behind them that hold u and v.
    const std::uint64_t parts = from.order[0] == 2 ? 3 : 6;
    const std::uint64_t rows = 2 * height / parts;
    if (message.data.size() == bytes && rows * parts == 2 * height) height = rows;
    bytes = height * step + count_colour_bytes(from, step, height);
  }
  const bool is_paired =
      from.kind == Kind::yuv || (from.kind == Kind::planes && from.order[0] == 2);
  if (is_paired && width % 2 != 0) fail("width", std::to_string(width), "even for YUV 4:2:2");
  if (is_paired && from.kind == Kind::planes && (height % 2 != 0 || step % 2 != 0)) {
    fail("height and step", std::to_string(height) + " and " + std::to_string(step),
         "even for YUV 4:2:0");
  }
  if (message.data.size() != bytes) {
    fail("data", std::to_string(message.data.size()) + " bytes",
         std::to_string(bytes) + (from.kind == Kind::planes ? ", all planes" : ", height x step"));
  }
  return height;
}

}  // namespace

panonav::Image to_image(const Image& message, const ImageLimits& limits) {
  const Encoding& from = find_encoding(message.encoding);
  const std::uint64_t height = check_layout(message, from, limits);
  const bool grey = from.kind == Kind::interleaved && from.channels == 1;
  panonav::Image picture(static_cast<int>(message.width), static_cast<int>(height), grey ? 1 : 3);
  const Row data = message.data.data();
  if (from.kind == Kind::bayer) {
    convert_bayer(message, data, from, picture);
    return picture;
  }
  if (from.kind == Kind::planes) {
    convert_planes(data, message.step, from, picture);
    return picture;
  }
  SampleReader read(from, message.is_bigendian != 0);
  for (int v = 0; v < picture.height() && from.sample_bytes == 4; ++v)
    read.scale_by(data + static_cast<std::size_t>(v) * message.step, message.width);
  for (int v = 0; v < picture.height(); ++v) {
    const Row row = data + static_cast<std::size_t>(v) * message.step;
    std::uint8_t* to = &picture.at(0, v);
    if (from.kind == Kind::yuv) {
      convert_yuv_row(row, from, picture.width(), to);
    } else {
      convert_interleaved_row(row, from, read, picture.width(), picture.channels(), to);
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
