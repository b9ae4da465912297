#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/io/image_file.hpp"

/// The codecs of image_file.hpp, in a source file each, because their C headers cannot be included
/// together.
namespace panonav::detail {

/// Throws FileError if a picture of this size exceeds the limits.
void check_image_size(ImageSize size, std::string_view name, const ImageLimits& limits);

/// Returns the orientation, 1 .. 8, of an EXIF block that begins with its byte order; 1, which is
/// upright, if it has none that can be read.
[[nodiscard]] int read_exif_orientation(std::span<const std::uint8_t> exif);
[[nodiscard]] ImageSize upright_size(ImageSize stored, int orientation);
[[nodiscard]] Image apply_exif_orientation(Image stored, int orientation);

[[nodiscard]] Image decode_png(std::span<const std::uint8_t> bytes, std::string_view name,
                               const ImageLimits& limits);
/// Returns the values of a grey PNG with 16 bits; nullopt for other kinds of PNG.
[[nodiscard]] std::optional<GreyLevels> decode_png_of_16_bits(std::span<const std::uint8_t> bytes,
                                                              std::string_view name,
                                                              const ImageLimits& limits);
[[nodiscard]] ImageSize png_size(std::span<const std::uint8_t> bytes, std::string_view name,
                                 const ImageLimits& limits);
[[nodiscard]] std::vector<std::uint8_t> encode_png(ImageView image);

/// Colours of a decoded JPEG: all, or only the luma of one that stores it apart, in a third of the
/// time. The luma is the grey level of `to_grey`, up to rounding.
enum class JpegColours { all, luma };
[[nodiscard]] Image decode_jpeg(std::span<const std::uint8_t> bytes, std::string_view name,
                                const ImageLimits& limits, JpegColours colours = JpegColours::all);
/// Decodes at an eighth of the size, only to find damage. Returns the size of the upright picture.
[[nodiscard]] ImageSize check_jpeg(std::span<const std::uint8_t> bytes, std::string_view name,
                                   const ImageLimits& limits);
[[nodiscard]] std::vector<std::uint8_t> encode_jpeg(ImageView image, int quality);
[[nodiscard]] ImageSize jpeg_size(std::span<const std::uint8_t> bytes, std::string_view name,
                                  const ImageLimits& limits);

}  // namespace panonav::detail
