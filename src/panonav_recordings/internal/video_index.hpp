#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "panonav/core/image.hpp"

namespace panonav::recordings {

/// The pictures of a video, as ffprobe lists them.
struct VideoIndex {
  double unit_s = 0.0;               ///< seconds of a stamp of 1
  std::string unit;                  ///< the same as a fraction, "1/12800"
  std::vector<std::int64_t> stamps;  ///< ascending
  int track = 0;                     ///< number of the track among those with pictures
  int right_track = -1;              ///< track of the second lens, to the right of it; -1: none
  std::string right_file;            ///< file of `right_track`; empty: the same
  ImageSize size;                    ///< of one track's pictures
};

/// Lists the pictures of the largest track of a video, and finds the second lens: two tracks of one
/// size that is about square, as cameras with two lenses record them, or the only track of
/// `right_file`, if it is not empty. Throws FileError if ffprobe is missing, a file has no pictures
/// or no times, two tracks are halves of a cube map, or the two files are not those of two lenses.
[[nodiscard]] VideoIndex read_video_index(const std::string& file,
                                          const std::string& right_file = {});

}  // namespace panonav::recordings
