#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace panonav::testing {

/// Makes a grey PNG file with 16 bits per pixel, without compression; rows from the top.
inline std::string make_grey_png_of_16_bits(int width, int height,
                                            const std::vector<std::uint16_t>& values) {
  const auto number = [](std::uint32_t value) {
    std::string bytes;
    for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(value >> shift);
    return bytes;
  };
  const auto chunk = [&](const std::string& content) {  // name and data
    std::uint32_t crc = 0xFFFFFFFFU;
    for (const char c : content) {
      crc ^= static_cast<std::uint8_t>(c);
      for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
    }
    return number(static_cast<std::uint32_t>(content.size() - 4)) + content +
           number(crc ^ 0xFFFFFFFFU);
  };
  std::string data = "\x78\x01";
  std::uint32_t a = 1;
  std::uint32_t b = 0;
  for (int v = 0; v < height; ++v) {  // one stored block for each row, with filter 0
    std::string row(1, '\0');
    for (int u = 0; u < width; ++u) {
      const std::uint16_t value = values.at(static_cast<std::size_t>(v) * width + u);
      row += static_cast<char>(value >> 8U);
      row += static_cast<char>(value & 0xFFU);
    }
    const auto size = static_cast<std::uint16_t>(row.size());
    data += static_cast<char>(v + 1 == height ? 1 : 0);
    for (const std::uint16_t length : {size, static_cast<std::uint16_t>(~size)}) {
      data += static_cast<char>(length & 0xFFU);
      data += static_cast<char>(length >> 8U);
    }
    data += row;
    for (const char c : row) {
      a = (a + static_cast<std::uint8_t>(c)) % 65521;
      b = (b + a) % 65521;
    }
  }
  data += number(b << 16U | a);
  std::string head = "IHDR" + number(static_cast<std::uint32_t>(width)) +
                     number(static_cast<std::uint32_t>(height));
  head += std::string("\x10\0\0\0\0", 5);  // 16 bits, grey
  return "\x89PNG\r\n\x1a\n" + chunk(head) + chunk("IDAT" + data) + chunk("IEND");
}

}  // namespace panonav::testing
