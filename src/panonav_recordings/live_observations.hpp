#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "panonav/pipeline/observation_source.hpp"
#include "panonav_recordings/live_pictures.hpp"

namespace panonav::recordings {

/// Provides the newest picture of a live source (`LivePictures`) at each call as an observation,
/// named by its stamp ("2026-11-23T05:06:07.123456Z").
class LiveObservations final : public ObservationSource {
 public:
  /// Opens the source. Throws as `LivePictures`.
  LiveObservations(const std::string& address, PictureSource pictures,
                   const LiveOptions& options = {})
      : pictures_(std::move(pictures)), live_(address, options) {}

  [[nodiscard]] const PictureSource& pictures() const noexcept override { return pictures_; }
  [[nodiscard]] std::optional<Observation> next() override;
  /// Returns the source, for `stop` and `counts`.
  [[nodiscard]] LivePictures& live() noexcept { return live_; }
  /// Times of a picture.
  struct Timing {
    std::chrono::steady_clock::time_point arrived{};  ///< on the steady clock
    std::chrono::steady_clock::duration decoding{};   ///< 0 if ffmpeg decoded
  };
  /// Returns the times of the picture that `next` returned last.
  [[nodiscard]] const Timing& timing() const noexcept { return timing_; }

 private:
  PictureSource pictures_;
  LivePictures live_;
  Timing timing_;
  std::optional<std::int64_t> last_us_;  ///< stamp of the last picture, in microseconds
};

}  // namespace panonav::recordings
