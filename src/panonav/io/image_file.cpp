#include "panonav/io/image_file.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/internal/image_codecs.hpp"

namespace panonav {

namespace {

constexpr std::size_t image_limit_bytes = std::size_t{1} << 30U;

using Bytes = std::span<const std::uint8_t>;

}  // namespace

ImageFormat image_format(Bytes bytes, std::string_view name) {
  constexpr std::array<std::uint8_t, 8> png{0x89, 'P', 'N', 'G', 0x0D, 0x0A, 0x1A, 0x0A};
  constexpr std::array<std::uint8_t, 3> jpeg{0xFF, 0xD8, 0xFF};
  const auto starts_with = [&](Bytes magic) {
    return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin());
  };
  if (starts_with(png)) return ImageFormat::png;
  if (starts_with(jpeg)) return ImageFormat::jpeg;
  throw FileError(name, bytes.empty() ? "is empty; allowed: a PNG or JPEG image"
                                      : "is not an image that can be read; allowed: PNG, JPEG");
}

std::vector<std::uint8_t> read_encoded_image(const std::filesystem::path& path) {
  auto bytes = read_file(path, image_limit_bytes);
  (void)image_format(bytes, path.string());
  return bytes;
}

Image decode_image(Bytes bytes, std::string_view name, const ImageLimits& limits) {
  return image_format(bytes, name) == ImageFormat::png ? detail::decode_png(bytes, name, limits)
                                                       : detail::decode_jpeg(bytes, name, limits);
}

Image read_image(const std::filesystem::path& path, const ImageLimits& limits) {
  const auto bytes = read_file(path, image_limit_bytes);
  return decode_image(bytes, path.string(), limits);
}

Image read_grey_image(const std::filesystem::path& path, const ImageLimits& limits) {
  const auto bytes = read_file(path, image_limit_bytes);
  const std::string name = path.string();
  Image image = image_format(bytes, name) == ImageFormat::png
                    ? detail::decode_png(bytes, name, limits)
                    : detail::decode_jpeg(bytes, name, limits, detail::JpegColours::luma);
  return image.channels() == 1 ? std::move(image) : to_grey(image.view());
}

GreyLevels read_grey_levels(const std::filesystem::path& path, const ImageLimits& limits) {
  const auto bytes = read_file(path, image_limit_bytes);
  const std::string name = path.string();
  if (image_format(bytes, name) == ImageFormat::png) {
    if (auto levels = detail::decode_png_of_16_bits(bytes, name, limits)) return *std::move(levels);
  }
  const Image image = decode_image(bytes, name, limits);
  const Image grey = to_grey(image.view());
  GreyLevels levels{grey.width(), grey.height(), {}};
  for (const std::uint8_t value : grey.pixels())
    levels.values.push_back(static_cast<std::uint16_t>(257 * value));
  return levels;
}

ImageSize read_image_size(const std::filesystem::path& path, const ImageLimits& limits) {
  const auto bytes = read_file(path, image_limit_bytes);
  const std::string name = path.string();
  return image_format(bytes, name) == ImageFormat::png ? detail::png_size(bytes, name, limits)
                                                       : detail::jpeg_size(bytes, name, limits);
}

ImageSize check_image(const std::filesystem::path& path, const ImageLimits& limits) {
  const auto bytes = read_file(path, image_limit_bytes);
  const std::string name = path.string();
  return image_format(bytes, name) == ImageFormat::png
             ? detail::decode_png(bytes, name, limits).size()
             : detail::check_jpeg(bytes, name, limits);
}

std::vector<std::uint8_t> encode_png(ImageView image) {
  return detail::encode_png(image);
}

std::vector<std::uint8_t> encode_jpeg(ImageView image, int quality) {
  return detail::encode_jpeg(image, quality);
}

void write_png(const std::filesystem::path& path, ImageView image) {
  const auto bytes = encode_png(image);
  write_file(path, bytes);
}

namespace detail {

void check_image_size(ImageSize size, std::string_view name, const ImageLimits& limits) {
  const std::int64_t area = std::int64_t{size.width} * size.height;
  if (size.width >= 1 && size.height >= 1 && size.width <= limits.side_px &&
      size.height <= limits.side_px && area <= limits.area_px) {
    return;
  }
  throw FileError(name, "image is " + std::to_string(size.width) + " x " +
                            std::to_string(size.height) + " px; allowed: 1 .. " +
                            std::to_string(limits.side_px) + " px a side and at most " +
                            std::to_string(limits.area_px) + " px in all");
}

int read_exif_orientation(Bytes exif) {
  const bool little = exif.size() >= 8 && exif[0] == 'I' && exif[1] == 'I';
  const bool big = exif.size() >= 8 && exif[0] == 'M' && exif[1] == 'M';
  if (!little && !big) return 1;
  const auto number = [&](std::size_t at, std::size_t bytes) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) {
      value = value << 8U | exif[at + (little ? bytes - 1 - i : i)];
    }
    return value;
  };
  constexpr std::size_t entry_bytes = 12;
  const std::size_t directory = number(4, 4);
  if (directory > exif.size() - 2) return 1;
  const std::size_t entries =
      std::min(number(directory, 2), (exif.size() - 2 - directory) / entry_bytes);
  for (std::size_t i = 0; i < entries; ++i) {
    const std::size_t entry = directory + 2 + i * entry_bytes;
    constexpr std::size_t orientation_tag = 0x0112;
    constexpr std::size_t short_type = 3;
    if (number(entry, 2) != orientation_tag || number(entry + 2, 2) != short_type) continue;
    const std::size_t value = number(entry + 8, 2);
    return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
  }
  return 1;
}

ImageSize upright_size(ImageSize stored, int orientation) {
  return orientation >= 5 ? ImageSize{stored.height, stored.width} : stored;
}

Image apply_exif_orientation(Image stored, int orientation) {
  if (orientation == 1) return stored;
  // Copies from the stored pixel that belongs to (u, v) of the upright picture [EXIF 2.32, tag
  // 0x0112].
  const bool is_transposed = orientation >= 5;
  const bool from_right =
      orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool from_bottom =
      orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  const ImageSize size = upright_size(stored.size(), orientation);
  Image image(size.width, size.height, stored.channels());
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const int x = is_transposed ? v : u;
      const int y = is_transposed ? u : v;
      std::copy_n(&stored.at(from_right ? stored.width() - 1 - x : x,
                             from_bottom ? stored.height() - 1 - y : y),
                  stored.channels(), &image.at(u, v));
    }
  }
  return image;
}

}  // namespace detail

}  // namespace panonav
