#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "panonav/io/dataset.hpp"
#include "panonav_recordings/internal/decoded_video.hpp"
#include "panonav_recordings/internal/video_index.hpp"

namespace panonav::recordings {

/// Pictures of a video file, decoded on demand by ffmpeg. In ascending order each is decoded once.
class VideoStore final : public PictureStore {
 public:
  /// `chosen` has the stamps of the selected pictures; `every_s`: seconds between them, at least,
  /// if they were selected by time.
  VideoStore(std::string file, VideoIndex chosen, std::optional<double> every_s, ImageLimits limits)
      : file_(std::move(file)), chosen_(std::move(chosen)), every_s_(every_s), limits_(limits) {}

  [[nodiscard]] Image read(std::size_t number) const override;

 private:
  [[nodiscard]] double seconds(std::int64_t stamp) const {
    return static_cast<double>(stamp) * chosen_.unit_s;
  }
  [[nodiscard]] std::optional<Image> decode_up_to(std::int64_t stamp_to_find) const;
  /// Starts ffmpeg at a picture. It converts and sends only the selected pictures from there on.
  void start_decoding(std::size_t number, bool sought) const;
  /// Keeps a decoded picture, because threads request pictures slightly out of order.
  void keep_for_later(DecodedFrame&& frame) const;

  std::string file_;
  VideoIndex chosen_;
  std::optional<double> every_s_;
  ImageLimits limits_;
  mutable std::mutex mutex_;
  mutable std::optional<DecodedVideo> frames_;
  mutable std::int64_t last_ = 0;
  mutable std::map<std::int64_t, Image> kept_pictures_;
};

}  // namespace panonav::recordings
