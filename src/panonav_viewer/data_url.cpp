#include "panonav_viewer/data_url.hpp"

#include <cstddef>

namespace panonav::viewer {

std::string make_data_url(std::string_view type, std::span<const std::uint8_t> bytes) {
  constexpr std::string_view letters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text = "data:" + std::string(type) + ";base64,";
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t j = i; j < i + 3; ++j) {
      three = three << 8U | (j < bytes.size() ? bytes[j] : 0U);
    }
    for (std::size_t j = 0; j < 4; ++j) {
      text += i + j <= bytes.size() ? letters[three >> (18 - 6 * j) & 63U] : '=';
    }
  }
  return text;
}

}  // namespace panonav::viewer
