#pragma once

#include <filesystem>
#include <vector>

#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::recordings {

/// True for a video (`identify_media_file`), and for a folder with videos but no images, as the
/// chapters of a long video.
[[nodiscard]] bool is_video(const std::filesystem::path& path);

/// Reads a video as a data set; stamps are those of the file in seconds, names like
/// "walk.mp4@12.345678". The program `ffmpeg` decodes pictures when they are read. In ascending
/// order each is decoded once; at most 256 MB of pictures are held; an earlier picture costs a
/// seek. They are upright with three channels; codecs that store RGB without loss give the
/// stored pixels. Two square tracks, as of two lenses, are set side by side, also from two files
/// (Insta360: VID_*_00_*.insv beside VID_*_10_*.insv). A folder is read by `read_videos`. Throws
/// FileError if the program is missing or the file has no video. Pictures beyond the limits or
/// that cannot be decoded throw when they are read. Cost: one pass.
[[nodiscard]] Dataset read_video(const std::filesystem::path& path, PictureSource source,
                                 const Dataset::Selection& selection = {},
                                 const ImageLimits& limits = {});
/// Reads several videos as one data set, as the chapters into which cameras cut a long video: in
/// the given order, those of a folder in that of their numbers. Stamps continue from one to the
/// next. Throws FileError as `read_video`, and if their images have different sizes.
[[nodiscard]] Dataset read_videos(const std::vector<std::filesystem::path>& paths,
                                  PictureSource source, const Dataset::Selection& selection = {},
                                  const ImageLimits& limits = {});

}  // namespace panonav::recordings
