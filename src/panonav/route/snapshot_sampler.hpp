#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "panonav/relative_pose/home_vector.hpp"

namespace panonav {

/// Size of the views that a `SnapshotSampler` computes, and the number of its samples. The defaults
/// lose 0.02 of the homeward component of unwarped panoramas with pictures of 160 x 120; a quarter
/// of the samples, 48 x 2, loses 0.07, and 24 x 2 loses 0.27 (docs/performance.md).
struct SamplerShape {
  int rows = 8;        ///< of the view, from the highest elevation to the lowest
  int components = 6;  ///< of the view, 2 .. azimuths / 2
  int azimuths = 48;   ///< samples along a row, at most 64
  int elevations = 8;  ///< samples across a row at each azimuth

  /// Largest number of azimuths.
  static constexpr int max_azimuths = 64;
  /// Number of samples of a picture.
  [[nodiscard]] constexpr std::size_t samples() const noexcept {
    return static_cast<std::size_t>(rows) * static_cast<std::size_t>(azimuths) *
           static_cast<std::size_t>(elevations);
  }
};

/// Computes the view of a picture from a few of its pixels, without unwarping it, heap memory or
/// exceptions, with the same bits on a microcontroller. The samples are scaled as preprocessing
/// scales panoramas: mean 0 and standard deviation 0.25.
class SnapshotSampler {
 public:
  /// `pixels`: an index into the picture for each sample, rows first, then azimuths
  /// counter-clockwise from straight ahead, then elevations, as `make_sampler_pixels` makes them;
  /// they outlive the sampler and may lie in flash memory.
  SnapshotSampler(const SamplerShape& shape, std::span<const std::uint16_t> pixels) noexcept;

  /// Computes a_k and b_k, component-major, rows * components of each. `picture`: grey, and larger
  /// than all indices. Cost: an addition per sample, and 2 rows * components * azimuths
  /// multiplications.
  void sample(std::span<const std::uint8_t> picture, std::span<float> cosines,
              std::span<float> sines) const noexcept;

  /// The shape of the views.
  [[nodiscard]] const SamplerShape& shape() const noexcept { return shape_; }

 private:
  SamplerShape shape_;
  std::span<const std::uint16_t> pixels_;
  // Directions of the azimuths.
  std::array<float, SamplerShape::max_azimuths> cosine_{};
  std::array<float, SamplerShape::max_azimuths> sine_{};
};

}  // namespace panonav
