#include "panonav/io/exif.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

#include "panonav/io/image_file.hpp"

namespace panonav {

namespace {

using ExifBytes = std::span<const std::uint8_t>;

/// Reader of the TIFF structure of EXIF data; numbers beyond the end are 0.
struct ExifReader {
  ExifBytes bytes;
  bool is_little = true;

  [[nodiscard]] std::size_t number(std::size_t at, std::size_t count) const {
    if (at > bytes.size() || bytes.size() - at < count) return 0;
    std::size_t value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      value = value << 8U | bytes[at + (is_little ? count - 1 - i : i)];
    }
    return value;
  }
  /// Returns the value of an entry of a directory; nullopt if it has none of this tag and type.
  [[nodiscard]] std::optional<std::size_t> find(std::size_t directory, std::size_t tag,
                                                std::size_t type) const {
    constexpr std::size_t entry_bytes = 12;
    constexpr std::size_t max_entries = 1000;  // of hostile files
    const std::size_t count = std::min(number(directory, 2), max_entries);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t entry = directory + 2 + i * entry_bytes;
      if (number(entry, 2) != tag || number(entry + 2, 2) != type) continue;
      constexpr std::size_t short_type = 3;
      return number(entry + 8, type == short_type ? 2 : 4);
    }
    return std::nullopt;
  }
};

std::optional<double> find_in_exif(ExifBytes exif) {
  if (exif.size() < 8 || exif[0] != exif[1] || (exif[0] != 'I' && exif[0] != 'M')) return {};
  const ExifReader reader{exif, exif[0] == 'I'};
  constexpr std::size_t short_type = 3;
  constexpr std::size_t long_type = 4;
  constexpr std::size_t exif_directory_tag = 0x8769;
  constexpr std::size_t focal_length_tag = 0xA405;
  const auto directory = reader.find(reader.number(4, 4), exif_directory_tag, long_type);
  if (!directory) return {};
  const auto found = reader.find(*directory, focal_length_tag, short_type);
  return found && *found > 0 ? std::optional(static_cast<double>(*found)) : std::nullopt;
}

}  // namespace

std::optional<double> find_focal_length_35mm(std::span<const std::uint8_t> jpeg) {
  constexpr std::string_view name("Exif\0\0", 6);
  constexpr std::uint8_t application_1 = 0xE1;
  constexpr std::uint8_t start_of_scan = 0xDA;
  std::size_t at = 2;
  while (at + 4 <= jpeg.size() && jpeg[at] == 0xFF && jpeg[at + 1] != start_of_scan) {
    const std::size_t length = std::size_t{jpeg[at + 2]} << 8U | jpeg[at + 3];
    if (length < 2 || length > jpeg.size() - at - 2) return {};
    const ExifBytes content = jpeg.subspan(at + 4, length - 2);
    if (jpeg[at + 1] == application_1 && content.size() > name.size() &&
        std::equal(name.begin(), name.end(), content.begin())) {
      return find_in_exif(content.subspan(name.size()));
    }
    at += 2 + length;
  }
  return {};
}

std::optional<double> read_focal_length_35mm(const std::filesystem::path& file) {
  return find_focal_length_35mm(read_encoded_image(file));
}

}  // namespace panonav
