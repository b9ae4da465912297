#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace panonav::command {

/// Returns what the metadata of a PNG or JPEG file say, one line each: the maker and model of the
/// camera and the time (EXIF), and the crop, tilt and heading of a 360 degree image (GPano). What
/// is damaged is left out. The lines may contain any characters. Throws FileError if the file is no
/// image.
[[nodiscard]] std::vector<std::string> list_picture_facts(const std::filesystem::path& file);
/// True if the image's GPano data say that it shows only a sector, so that no verb takes it.
[[nodiscard]] bool is_sector(const std::filesystem::path& file);

}  // namespace panonav::command
