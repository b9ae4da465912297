#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace panonav::viewer {

/// Returns "data:image/png;base64,...": a file within a page or a drawing. `type`: "image/png".
[[nodiscard]] std::string data_url(std::string_view type, std::span<const std::uint8_t> bytes);

}  // namespace panonav::viewer
