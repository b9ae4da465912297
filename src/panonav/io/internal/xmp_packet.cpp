#include "panonav/io/internal/xmp_packet.hpp"

#include <zlib.h>

#include <array>
#include <cstdint>
#include <string_view>

namespace panonav::detail {

namespace {

using namespace std::string_view_literals;

constexpr std::size_t max_xmp_bytes = std::size_t{1} << 20U;

/// Reads exactly this many bytes; nullopt if the file ends before.
std::optional<std::string> read_bytes(std::istream& file, std::size_t count) {
  std::string bytes(count, '\0');
  if (!file.read(bytes.data(), static_cast<std::streamsize>(count))) return std::nullopt;
  return bytes;
}

/// Reads a number with the most significant byte first; nullopt if the file ends before.
std::optional<std::size_t> read_big_endian(std::istream& file, std::size_t bytes) {
  const auto text = read_bytes(file, bytes);
  if (!text) return std::nullopt;
  std::size_t value = 0;
  for (const char byte : *text) value = value << 8U | static_cast<unsigned char>(byte);
  return value;
}

std::optional<std::string> read_jpeg_xmp(std::istream& file) {
  constexpr std::size_t app1 = 0xE1;
  constexpr std::size_t start_of_scan = 0xDA;
  constexpr auto name = "http://ns.adobe.com/xap/1.0/\0"sv;
  while (const auto begin = read_big_endian(file, 1)) {
    if (*begin != 0xFF) return std::nullopt;
    auto marker = read_big_endian(file, 1);
    while (marker && *marker == 0xFF) marker = read_big_endian(file, 1);  // padding
    const auto size = marker ? read_big_endian(file, 2) : std::nullopt;
    if (!size || *size < 2 || *marker == start_of_scan) return std::nullopt;
    if (*marker != app1) {
      file.seekg(static_cast<std::streamoff>(*size - 2), std::ios::cur);
      continue;
    }
    auto content = read_bytes(file, *size - 2);
    if (!content) return std::nullopt;
    if (content->starts_with(name)) return content->substr(name.size());
  }
  return std::nullopt;
}

/// Inflates a zlib stream; nullopt if it is damaged or too long.
std::optional<std::string> inflate_text(std::string_view packed) {
  std::string text(max_xmp_bytes, '\0');
  auto length = static_cast<uLongf>(text.size());
  if (uncompress(reinterpret_cast<Bytef*>(text.data()), &length,
                 reinterpret_cast<const Bytef*>(packed.data()),
                 static_cast<uLong>(packed.size())) != Z_OK) {
    return std::nullopt;
  }
  text.resize(length);
  return text;
}

/// Returns the text of an iTXt chunk after its keyword [PNG 1.2, 4.2.3.3].
std::optional<std::string> read_international_text(std::string_view content) {
  if (content.size() < 2) return std::nullopt;
  const bool is_compressed = content[0] != 0;
  content.remove_prefix(2);
  for (int i = 0; i < 2; ++i) {  // language and translated keyword
    const std::size_t end = content.find('\0');
    if (end == content.npos) return std::nullopt;
    content.remove_prefix(end + 1);
  }
  return is_compressed ? inflate_text(content) : std::string(content);
}

std::optional<std::string> read_png_xmp(std::istream& file) {
  constexpr auto keyword = "XML:com.adobe.xmp\0"sv;
  constexpr std::size_t checksum_bytes = 4;
  while (const auto size = read_big_endian(file, 4)) {
    const auto name = read_bytes(file, 4);
    if (!name || *name == "IEND") return std::nullopt;
    if (*name == "iTXt" && *size <= max_xmp_bytes) {
      const auto content = read_bytes(file, *size);
      if (!content) return std::nullopt;
      if (content->starts_with(keyword)) {
        return read_international_text(std::string_view(*content).substr(keyword.size()));
      }
      file.seekg(checksum_bytes, std::ios::cur);
    } else {
      file.seekg(static_cast<std::streamoff>(*size + checksum_bytes), std::ios::cur);
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> read_xmp_packet(std::istream& file) {
  const auto head = read_bytes(file, 2);
  if (!head) return std::nullopt;
  if (*head == "\xff\xd8"sv) return read_jpeg_xmp(file);
  const auto rest = read_bytes(file, 6);
  return rest && *head + *rest == "\x89PNG\r\n\x1a\n"sv ? read_png_xmp(file) : std::nullopt;
}

}  // namespace panonav::detail
