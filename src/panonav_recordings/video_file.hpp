#pragma once

#include <filesystem>

#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::recordings {

/// True if the name ends as that of a video: mp4, m4v, mov, mkv, webm or avi.
[[nodiscard]] bool is_video(const std::filesystem::path& file);

/// Reads a video as a data set; stamps are those of the file in seconds, names like
/// "walk.mp4@12.345678". The program `ffmpeg`, which must be installed, decodes pictures when they
/// are read. In ascending order each is decoded once, and at most 256 MB of pictures are held; an
/// earlier picture costs a seek. They are upright and have three channels; codecs that store RGB
/// without loss give the stored pixels. Throws FileError if the program is missing or the file has
/// no video. Pictures that are beyond the limits or cannot be decoded throw when they are read.
/// Cost: one pass over the file without decoding.
[[nodiscard]] Dataset read_video(const std::filesystem::path& file, PictureSource source,
                                 const Dataset::Selection& selection = {},
                                 const ImageLimits& limits = {});

}  // namespace panonav::recordings
