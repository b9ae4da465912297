#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "panonav/core/image.hpp"

namespace panonav {

/// Limits of pictures. Larger pictures are refused before memory is allocated, and those with too
/// many scans before they are decoded.
struct ImageLimits {
  int side_px = 32768;               ///< the longest side, in pixels
  std::int64_t area_px = 134217728;  ///< 16384 x 8192
  /// Limit of the work for a JPEG, in pixels: the sum over its scans of its area + 65536. A
  /// progressive picture has about ten scans, but a small hostile file can have thousands.
  std::int64_t scanned_px = std::int64_t{16} * 134217728;
};

/// Reads a PNG or JPEG file, which it identifies by the first bytes, and turns the picture upright
/// by its EXIF orientation. Grey pictures of any bit depth give one channel of 8 bit, colour and
/// palette pictures three. 16-bit values are scaled. Alpha channels are dropped (the stored colours
/// are those of the camera); gamma chunks and colour profiles are ignored. Throws FileError if the
/// file is missing, of another format, damaged, cut short or beyond the limits; no content can make
/// it crash.
[[nodiscard]] Image read_image(const std::filesystem::path& path, const ImageLimits& limits = {});
/// Reads a picture in grey. Of a JPEG, only the luma is decoded; it differs from `to_grey` of the
/// colours by rounding. Throws as `read_image`.
[[nodiscard]] Image read_grey_image(const std::filesystem::path& path,
                                    const ImageLimits& limits = {});

/// Grey levels of a picture with 16 bits each.
struct GreyLevels {
  int width = 0;                      ///< pixels per row
  int height = 0;                     ///< number of rows
  std::vector<std::uint16_t> values;  ///< row-major, rows from the top; 65535 is white
};

/// Reads a PNG or JPEG file as `read_image` does, but keeps the 16 bits of grey PNG files and does
/// not turn the picture. Values of fewer bits are scaled to 0 .. 65535, colours become grey. Throws
/// FileError as `read_image`.
[[nodiscard]] GreyLevels read_grey_levels(const std::filesystem::path& path,
                                          const ImageLimits& limits = {});

/// A format of picture files.
enum class ImageFormat {
  png,  ///< lossless
  jpeg  ///< with losses
};

/// Returns the format by the first bytes. Throws a FileError on `name` for any other format.
[[nodiscard]] ImageFormat image_format(std::span<const std::uint8_t> bytes, std::string_view name);

/// Reads the bytes of a PNG or JPEG file. Throws FileError if its first bytes are of another
/// format.
[[nodiscard]] std::vector<std::uint8_t> read_encoded_image(const std::filesystem::path& path);

/// Reads width and height of the upright picture from the head of the file, without decoding the
/// pixels. Throws FileError.
[[nodiscard]] ImageSize read_image_size(const std::filesystem::path& path,
                                        const ImageLimits& limits = {});

/// Checks that `read_image` can read a file, and returns the size of the upright picture. Throws
/// FileError as `read_image`. Cost: decodes the file, a JPEG at an eighth of its size, in about
/// half of the time.
ImageSize check_image(const std::filesystem::path& path, const ImageLimits& limits = {});

/// Decodes a PNG or JPEG in memory as `read_image` does; `name` appears in error messages.
[[nodiscard]] Image decode_image(std::span<const std::uint8_t> bytes, std::string_view name,
                                 const ImageLimits& limits = {});

/// Encodes a picture (1 or 3 channels) as PNG. Throws ContractError on an empty picture.
[[nodiscard]] std::vector<std::uint8_t> encode_png(ImageView image);

/// Encodes a picture (1 or 3 channels, sides at most 65,500 px) as baseline JPEG. `quality` is 1 ..
/// 100. About 3 ms for 1280 x 640 x 3. Throws ContractError if a value is out of range.
[[nodiscard]] std::vector<std::uint8_t> encode_jpeg(ImageView image, int quality = 85);

/// Writes a PNG completely or not at all (`write_file`). Throws FileError.
void write_png(const std::filesystem::path& path, ImageView image);

}  // namespace panonav
