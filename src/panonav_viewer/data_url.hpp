#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace panonav::viewer {

/// Returns "data:image/png;base64,..." with the bytes of a file, to embed it in a page or a
/// drawing. `type` is the media type, as "image/png".
[[nodiscard]] std::string make_data_url(std::string_view type, std::span<const std::uint8_t> bytes);

}  // namespace panonav::viewer
