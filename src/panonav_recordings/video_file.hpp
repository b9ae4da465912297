#pragma once

#include <filesystem>

#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::recordings {

/// True if the name is that of a video: mp4, m4v, mov, mkv, webm or avi.
[[nodiscard]] bool is_video(const std::filesystem::path& file);

/// Reads a video as a data set: stamps in seconds as the file has them, names "walk.mp4@12.345678".
/// Pictures are decoded when they are read, by the program `ffmpeg`, which must be installed: at
/// ascending numbers each once, with at most 256 MB of pictures held; going back costs a seek. They
/// are upright and have three channels; of a codec that stores RGB without loss they are the stored
/// pixels. Throws FileError: no such program, no video in the file, a picture beyond the limits.
/// One that cannot be decoded throws when it is read. Cost: one pass over the file without
/// decoding.
[[nodiscard]] Dataset read_video(const std::filesystem::path& file, PictureSource source,
                                 const Dataset::Selection& selection = {},
                                 const ImageLimits& limits = {});

}  // namespace panonav::recordings
