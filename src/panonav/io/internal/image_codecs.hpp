#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "panonav/core/image.hpp"

/// The two codecs behind image_file.hpp, one file each, because their C headers do not mix.
namespace panonav::detail {

/// Throws FileError unless a picture of this size may be read.
void check_image_size(std::int64_t width, std::int64_t height, std::string_view name);

[[nodiscard]] Image decode_png(std::span<const std::uint8_t> bytes, std::string_view name);
[[nodiscard]] std::vector<std::uint8_t> encode_png(ImageView image);

[[nodiscard]] Image decode_jpeg(std::span<const std::uint8_t> bytes, std::string_view name);

}  // namespace panonav::detail
