#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

namespace panonav {

/// Returns the focal length for 35 mm film, in millimetres, that the EXIF data of a JPEG picture
/// state (FocalLengthIn35mmFilm [EXIF 2.32, tag 0xA405]); nullopt if there is none, also on damaged
/// data.
[[nodiscard]] std::optional<double> find_focal_length_35mm(std::span<const std::uint8_t> jpeg);
/// Reads the head of a picture file. Throws FileError if it cannot be read.
[[nodiscard]] std::optional<double> read_focal_length_35mm(const std::filesystem::path& file);

}  // namespace panonav
