#pragma once

#include <filesystem>

#include "panonav/io/dataset.hpp"

namespace panonav::recordings {

/// True for a picture in a format that only ffmpeg reads (`MediaKind::foreign_picture`), and for a
/// folder with such pictures, but without PNG or JPEG and without a description.
[[nodiscard]] bool is_foreign_picture(const std::filesystem::path& path);

/// Reads such a picture or folder as a data set, in natural order. Each picture is decoded by a
/// process of ffmpeg when it is read; one that ffmpeg cannot decode throws FileError then, with
/// what to do.
[[nodiscard]] Dataset read_foreign_pictures(const std::filesystem::path& path,
                                            PictureSource source);

}  // namespace panonav::recordings
