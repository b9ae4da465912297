#include "panonav/io/image_file.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/internal/image_codecs.hpp"

namespace panonav {

namespace {

constexpr std::size_t file_limit_bytes = std::size_t{1} << 30U;

using Bytes = std::span<const std::uint8_t>;

enum class Format { png, jpeg };

Format format_of(Bytes bytes, std::string_view name) {
  constexpr std::array<std::uint8_t, 8> png{0x89, 'P', 'N', 'G', 0x0D, 0x0A, 0x1A, 0x0A};
  constexpr std::array<std::uint8_t, 3> jpeg{0xFF, 0xD8, 0xFF};
  const auto starts_with = [&](Bytes magic) {
    return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin());
  };
  if (starts_with(png)) return Format::png;
  if (starts_with(jpeg)) return Format::jpeg;
  throw FileError(name, bytes.empty() ? "is empty; allowed: a PNG or JPEG picture"
                                      : "is no picture that can be read; allowed: PNG, JPEG");
}

}  // namespace

Image decode_image(Bytes bytes, std::string_view name) {
  return format_of(bytes, name) == Format::png ? detail::decode_png(bytes, name)
                                               : detail::decode_jpeg(bytes, name);
}

Image read_image(const std::filesystem::path& path) {
  const auto bytes = read_file(path, file_limit_bytes);
  return decode_image(bytes, path.string());
}

std::vector<std::uint8_t> encode_png(ImageView image) {
  return detail::encode_png(image);
}

void write_png(const std::filesystem::path& path, ImageView image) {
  const auto bytes = encode_png(image);
  write_file(path, bytes);
}

namespace detail {

void check_image_size(std::int64_t width, std::int64_t height, std::string_view name) {
  if (width >= 1 && height >= 1 && width <= image_side_limit_px && height <= image_side_limit_px &&
      width * height <= image_area_limit_px) {
    return;
  }
  throw FileError(name, "picture is " + std::to_string(width) + " x " + std::to_string(height) +
                            " px; allowed: 1 .. " + std::to_string(image_side_limit_px) +
                            " px a side and at most " + std::to_string(image_area_limit_px) +
                            " px in all");
}

}  // namespace detail

}  // namespace panonav
