#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "panonav/core/image.hpp"

namespace panonav {

/// Largest picture that is read: sides and area. Larger ones are refused before memory is taken.
inline constexpr int image_side_limit_px = 32768;
inline constexpr std::int64_t image_area_limit_px = 134217728;

/// Reads a PNG or JPEG file, told apart by content. Grey pictures of any bit depth give one channel
/// of 8 bit, colour and palette pictures three; 16-bit values are scaled, an alpha channel is
/// dropped (the stored colours are what the camera saw), gamma chunks, colour profiles and EXIF
/// orientation are ignored. Throws FileError on a file that is missing, of another format, damaged,
/// cut short or too large; never crashes, whatever the bytes.
[[nodiscard]] Image read_image(const std::filesystem::path& path);

/// The same from bytes in memory; `name` stands in error messages.
[[nodiscard]] Image decode_image(std::span<const std::uint8_t> bytes, std::string_view name);

/// The picture (1 or 3 channels) as PNG. Throws ContractError on an empty picture.
[[nodiscard]] std::vector<std::uint8_t> encode_png(ImageView image);

/// Writes a PNG that appears whole or not at all. Throws FileError.
void write_png(const std::filesystem::path& path, ImageView image);

}  // namespace panonav
