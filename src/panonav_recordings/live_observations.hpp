#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "panonav/pipeline/observation_source.hpp"
#include "panonav_recordings/live_pictures.hpp"

namespace panonav::recordings {

/// Observations of a live source, the newest each time (`LivePictures`), named by their stamps
/// ("2026-11-23T05:06:07.123456Z").
class LiveObservations final : public ObservationSource {
 public:
  /// Opens the source. Throws as `LivePictures`.
  LiveObservations(const std::string& address, PictureSource pictures,
                   const LiveOptions& options = {})
      : pictures_(std::move(pictures)), live_(address, options) {}

  [[nodiscard]] const PictureSource& pictures() const noexcept override { return pictures_; }
  [[nodiscard]] std::optional<Observation> next() override;
  /// Returns the source, to stop it and for its counts.
  [[nodiscard]] LivePictures& live() noexcept { return live_; }
  /// Times of a picture.
  struct Timing {
    std::chrono::steady_clock::time_point arrived{};  ///< by the clock that is never set
    std::chrono::steady_clock::duration decoding{};   ///< how long decoding took, where we do it
  };
  /// Returns the times of the last picture of `next`.
  [[nodiscard]] const Timing& timing() const noexcept { return timing_; }

 private:
  PictureSource pictures_;
  LivePictures live_;
  Timing timing_;
  std::optional<std::int64_t> last_us_;  ///< stamp of the last picture, in microseconds
};

}  // namespace panonav::recordings
