#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "panonav/io/dataset.hpp"

namespace panonav::recordings {

/// True for a picture file in a format that only ffmpeg reads (`MediaKind::foreign_picture`).
[[nodiscard]] bool is_foreign_picture(const std::filesystem::path& path);

/// Makes a store of such files. Each picture is decoded by a process of ffmpeg when it is read; one
/// that ffmpeg cannot decode throws FileError then, with what to do.
[[nodiscard]] std::shared_ptr<const PictureStore> make_foreign_picture_store(
    std::vector<std::filesystem::path> files);

/// Reads such a file as a data set of one picture.
[[nodiscard]] Dataset read_foreign_picture(const std::filesystem::path& path, PictureSource source);

}  // namespace panonav::recordings
