#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/io/dataset.hpp"

namespace panonav::recordings {

/// Codec of a video whose packets are messages.
enum class VideoCodec { h264, h265 };

/// Returns the codec that the format of a message names, such as "h264", "hevc" or "h264;yuv420p";
/// nullopt if it is that of a picture file.
[[nodiscard]] std::optional<VideoCodec> find_video_codec(std::string_view format);

/// Collects the packets of a video (H.264 or H.265, with start codes: Annex B) in a temporary
/// Matroska file, in which the time of a packet is its number in milliseconds. ffmpeg decodes them
/// when they are read.
class RecordedVideo {
 public:
  /// Creates the file. Throws FileError that names `recording` if there is no temporary folder.
  RecordedVideo(VideoCodec codec, std::string recording);
  ~RecordedVideo();
  RecordedVideo(const RecordedVideo&) = delete;
  RecordedVideo& operator=(const RecordedVideo&) = delete;

  /// Adds a packet, in the order of decoding. Returns false if it gives no picture: it has only
  /// parameters, or comes before the first key frame. Throws FileError if the disk is full.
  bool add(std::span<const std::uint8_t> packet);
  /// Returns the pictures of the packets for which `add` returned true, in their order. The video
  /// must outlive them. Throws FileError.
  [[nodiscard]] std::shared_ptr<const PictureStore> pictures();

 private:
  void write(std::span<const std::uint8_t> bytes);

  VideoCodec codec_;
  std::string recording_;
  std::filesystem::path path_;
  std::ofstream file_;
  std::int64_t packets_ = 0;                   // written so far
  std::vector<std::int64_t> picture_numbers_;  // packets that give a picture
};

}  // namespace panonav::recordings
