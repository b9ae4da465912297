#pragma once

#include <filesystem>
#include <string_view>

namespace panonav {

/// Kind of a file with images, by its content.
enum class MediaKind {
  picture,          ///< PNG or JPEG
  foreign_picture,  ///< WebP, HEIC or AVIF, which the component `recordings` reads by ffmpeg
  video,  ///< MP4, MOV, Matroska, AVI, MPEG and the like; also with the names of cameras (.insv)
  other   ///< anything else
};

/// Identifies the kind by the first bytes of a file; 400 bytes are enough.
[[nodiscard]] MediaKind identify_media(std::string_view head);
/// Identifies a regular file by its first bytes, and one with unknown bytes as a video if it is
/// named as one (.mp4, .m4v, .mov, .mkv, .webm, .avi); `other` if it cannot be read. Never throws.
[[nodiscard]] MediaKind identify_media_file(const std::filesystem::path& file);

/// True if the file name begins with a point, as those of hidden files and of the companions "._*"
/// that macOS writes.
[[nodiscard]] bool is_hidden(const std::filesystem::path& file);

/// True if the file is a picture of a folder: one with the content of a PNG or JPEG, or named as
/// one (.png, .jpg, .jpeg, .insp), which is then damaged. Hidden files and thumbnails of videos
/// (.thm) are none.
[[nodiscard]] bool is_folder_picture(const std::filesystem::path& file);

}  // namespace panonav
