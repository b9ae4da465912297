#include "runs/picture_facts.hpp"

#include <algorithm>
#include <string_view>

#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/gpano.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::command {

namespace {

/// Reads the text fields of the first directory of an EXIF block, which is a TIFF file.
class ExifTexts {
 public:
  explicit ExifTexts(std::string_view tiff) : tiff_(tiff), little_(tiff.starts_with("II")) {}

  /// Returns the text of a tag without trailing blanks; empty if there is none.
  [[nodiscard]] std::string find(std::size_t tag) const {
    constexpr std::size_t entry_bytes = 12;
    constexpr std::size_t text_type = 2;
    const std::size_t directory = number(4, 4);
    const std::size_t count = number(directory, 2);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t entry = directory + 2 + i * entry_bytes;
      if (entry + entry_bytes > tiff_.size()) break;
      if (number(entry, 2) != tag || number(entry + 2, 2) != text_type) continue;
      const std::size_t length = number(entry + 4, 4);
      const std::size_t at = length <= 4 ? entry + 8 : number(entry + 8, 4);
      if (at >= tiff_.size()) break;
      std::string text(tiff_.substr(at, std::min<std::size_t>(length, 200)));
      text.resize(std::min(text.find('\0'), text.size()));
      while (text.ends_with(' ')) text.pop_back();
      return text;
    }
    return {};
  }

 private:
  /// Returns a number of 2 or 4 bytes; 0 beyond the end.
  [[nodiscard]] std::size_t number(std::size_t at, std::size_t bytes) const {
    if (at + bytes > tiff_.size()) return 0;
    std::size_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) {
      const char byte = tiff_[at + (little_ ? bytes - 1 - i : i)];
      value = value << 8U | static_cast<unsigned char>(byte);
    }
    return value;
  }

  std::string_view tiff_;
  bool little_;
};

void add_exif_facts(std::string_view text, std::vector<std::string>& facts) {
  constexpr std::string_view marker("Exif\0\0", 6);
  const std::size_t begin = text.find(marker);
  if (begin == text.npos) return;
  const ExifTexts exif(text.substr(begin + marker.size()));
  constexpr std::size_t maker_tag = 0x010f;
  constexpr std::size_t model_tag = 0x0110;
  constexpr std::size_t time_tag = 0x0132;
  const std::string maker = exif.find(maker_tag);
  const std::string model = exif.find(model_tag);
  if (!maker.empty() || !model.empty()) {
    facts.push_back("camera: " + maker + (maker.empty() || model.empty() ? "" : " ") + model);
  }
  if (const std::string time = exif.find(time_tag); !time.empty()) facts.push_back("time: " + time);
}

std::string format_deg(double rad) {
  return format_number(degrees(rad), "deg");
}

void add_gpano_facts(const GpanoData& data, std::vector<std::string>& facts) {
  if (!data.has_all_azimuths()) {
    facts.push_back(
        "GPano: a sector of " + format_deg(data.azimuth_width_rad) +
        " degrees; panonav needs images of all azimuths (if these data are wrong, verbs "
        "read it with --ignore-gpano)");
  }
  if (data.elevations && !is_whole_sphere(*data.elevations)) {
    facts.push_back("GPano: elevations from " + format_deg(data.elevations->bottom_rad) + " to " +
                    format_deg(data.elevations->top_rad) + " degrees");
  }
  if (data.pitch_rad != 0.0 || data.roll_rad != 0.0) {
    facts.push_back("GPano: camera tilted, pitch " + format_deg(data.pitch_rad) + " and roll " +
                    format_deg(data.roll_rad) +
                    " degrees; verbs level the image by them, unless --ignore-gpano is set");
  }
  if (data.heading_rad) {
    facts.push_back("GPano: the centre looks to " + format_deg(*data.heading_rad) +
                    " degrees of the compass; panonav does not use this");
  }
}

}  // namespace

bool is_sector(const std::filesystem::path& file) {
  const auto data = read_gpano(file);
  return data && !data->has_all_azimuths();
}

std::vector<std::string> list_picture_facts(const std::filesystem::path& file) {
  const auto bytes = read_encoded_image(file);
  constexpr std::size_t searched_bytes = 512U << 10U;  // metadata come before the pixels
  std::string text(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(
                                                      std::min(searched_bytes, bytes.size())));
  std::vector<std::string> facts;
  add_exif_facts(text, facts);
  if (const auto data = read_gpano(file)) add_gpano_facts(*data, facts);
  return facts;
}

}  // namespace panonav::command
