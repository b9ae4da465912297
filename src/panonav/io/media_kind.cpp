#include "panonav/io/media_kind.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <string>

#include "panonav/core/text.hpp"

namespace panonav {

namespace {

using namespace std::string_view_literals;

bool has_bytes_at(std::string_view head, std::size_t offset, std::string_view bytes) {
  return head.size() >= offset && head.substr(offset).starts_with(bytes);
}

/// True for WebP, and for HEIC and AVIF, which are images in boxes as those of MP4.
bool is_foreign_picture(std::string_view head) {
  constexpr std::array brands{"heic"sv, "heix"sv, "heim"sv, "heis"sv, "hevc"sv,
                              "mif1"sv, "msf1"sv, "avif"sv, "avis"sv};
  if (head.starts_with("RIFF")) return has_bytes_at(head, 8, "WEBP");
  return has_bytes_at(head, 4, "ftyp") && head.size() >= 12 &&
         std::ranges::find(brands, head.substr(8, 4)) != brands.end();
}

/// True for files of boxes as MP4 and QuickTime have them, but not for images in such boxes.
bool is_box_video(std::string_view head) {
  constexpr std::array images{"crx "sv, "jxl "sv};
  constexpr std::array old_boxes{"moov"sv, "mdat"sv, "wide"sv, "skip"sv, "free"sv, "pnot"sv};
  if (head.size() < 12) return false;
  const std::string_view box = head.substr(4, 4);
  if (box == "ftyp") return std::ranges::find(images, head.substr(8, 4)) == images.end();
  return std::ranges::find(old_boxes, box) != old_boxes.end();
}

/// True if a packet of an MPEG transport stream begins at each of the first places.
bool is_transport_stream(std::string_view head) {
  // Packets have 188 bytes; cameras and discs write a time stamp of 4 bytes before each.
  constexpr std::array<std::pair<std::size_t, std::size_t>, 2> forms{{{0, 188}, {4, 192}}};
  return std::ranges::any_of(forms, [&](const auto& form) {
    const auto& [first, step] = form;
    return head.size() > first + step && head[first] == 'G' && head[first + step] == 'G' &&
           (head.size() <= first + 2 * step || head[first + 2 * step] == 'G');
  });
}

}  // namespace

MediaKind identify_media(std::string_view head) {
  constexpr std::array pictures{"\x89PNG\r\n\x1a\n"sv, "\xff\xd8\xff"sv};
  // Matroska and WebM; MPEG program and elementary streams; Flash; Ogg; Windows Media.
  constexpr std::array videos{"\x1a\x45\xdf\xa3"sv,
                              "\0\0\1\xba"sv,
                              "\0\0\1\xb3"sv,
                              "FLV\1"sv,
                              "OggS"sv,
                              "\x30\x26\xb2\x75\x8e\x66\xcf\x11"sv};
  const auto begins = [&](std::string_view bytes) { return head.starts_with(bytes); };
  if (std::ranges::any_of(pictures, begins)) return MediaKind::picture;
  if (is_foreign_picture(head)) return MediaKind::foreign_picture;
  const bool is_avi = begins("RIFF") && has_bytes_at(head, 8, "AVI ");
  if (is_avi || std::ranges::any_of(videos, begins) || is_box_video(head) ||
      is_transport_stream(head)) {
    return MediaKind::video;
  }
  return MediaKind::other;
}

MediaKind identify_media_file(const std::filesystem::path& file) {
  constexpr std::array video_names{".mp4"sv, ".m4v"sv, ".mov"sv, ".mkv"sv, ".webm"sv, ".avi"sv};
  constexpr std::size_t head_bytes = 400;  // three packets of a transport stream begin in them
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return MediaKind::other;
  std::string head(head_bytes, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(stream.gcount(), 0)));
  const MediaKind kind = identify_media(head);
  if (kind != MediaKind::other) return kind;
  const std::string ending = to_lower_case(file.extension().native());
  const bool is_named = std::ranges::find(video_names, ending) != video_names.end();
  return is_named ? MediaKind::video : MediaKind::other;
}

bool is_hidden(const std::filesystem::path& file) {
  return file.filename().native().starts_with('.');
}

bool is_folder_picture(const std::filesystem::path& file) {
  constexpr std::array names{".png"sv, ".jpg"sv, ".jpeg"sv, ".insp"sv};
  const std::string ending = to_lower_case(file.extension().native());
  if (is_hidden(file) || ending == ".thm") return false;
  const MediaKind kind = identify_media_file(file);
  return kind == MediaKind::picture ||
         (kind == MediaKind::other && std::ranges::find(names, ending) != names.end());
}

}  // namespace panonav
