#include "panonav/route/snapshot_sampler.hpp"

#include <cmath>
#include <numbers>

#include "panonav/core/portable_math.hpp"

namespace panonav {

namespace {

/// Mean of samples, and the factor that scales their deviation.
struct SampleScale {
  float mean = 0.0F;
  float gain = 1.0F;
};

SampleScale compute_scale(std::span<const std::uint8_t> picture,
                          std::span<const std::uint16_t> pixels) noexcept {
  // As `normalising_gain`, for values from 0 to 255.
  constexpr double target_deviation = 0.25;
  constexpr double min_deviation = 0.25;
  std::uint32_t sum = 0;
  std::uint32_t squares = 0;
  for (const std::uint16_t pixel : pixels) {
    const std::uint32_t value = picture[pixel];
    sum += value;
    squares += value * value;
  }
  const auto count = static_cast<double>(pixels.size());
  const double mean = sum / count;
  const double variance = squares / count - mean * mean;
  const double deviation = variance > 0.0 ? std::sqrt(variance) : 0.0;
  const double gain = deviation >= min_deviation ? target_deviation / deviation : 1.0 / 255.0;
  return {static_cast<float>(mean), static_cast<float>(gain)};
}

}  // namespace

SnapshotSampler::SnapshotSampler(const SamplerShape& shape,
                                 std::span<const std::uint16_t> pixels) noexcept
    : shape_(shape), pixels_(pixels) {
  for (int j = 0; j < shape_.azimuths; ++j) {
    const auto [cosine, sine] = portable::cosine_sine(2.0 * std::numbers::pi * j / shape_.azimuths);
    cosine_[static_cast<std::size_t>(j)] = static_cast<float>(cosine);
    sine_[static_cast<std::size_t>(j)] = static_cast<float>(sine);
  }
}

void SnapshotSampler::sample(std::span<const std::uint8_t> picture, std::span<float> cosines,
                             std::span<float> sines) const noexcept {
  const SampleScale scale = compute_scale(picture, pixels_);
  const auto azimuths = static_cast<std::size_t>(shape_.azimuths);
  const auto elevations = static_cast<std::size_t>(shape_.elevations);
  const auto rows = static_cast<std::size_t>(shape_.rows);
  const float share = 1.0F / static_cast<float>(elevations);
  const float transform_share = 2.0F / static_cast<float>(azimuths);
  std::array<float, SamplerShape::max_azimuths> row;
  const std::uint16_t* pixel = pixels_.data();
  for (std::size_t y = 0; y < rows; ++y) {
    for (std::size_t j = 0; j < azimuths; ++j) {
      std::uint32_t sum = 0;
      for (std::size_t i = 0; i < elevations; ++i) sum += picture[*pixel++];
      row[j] = scale.gain * (share * static_cast<float>(sum) - scale.mean);
    }
    for (std::size_t k = 0; k < static_cast<std::size_t>(shape_.components); ++k) {
      float a = 0.0F;
      float b = 0.0F;
      std::size_t angle = 0;  // k j, modulo a full turn
      for (std::size_t j = 0; j < azimuths; ++j) {
        a += row[j] * cosine_[angle];
        b += row[j] * sine_[angle];
        angle += k;
        if (angle >= azimuths) angle -= azimuths;
      }
      cosines[k * rows + y] = transform_share * a;
      sines[k * rows + y] = k == 0 ? 0.0F : transform_share * b;
    }
  }
}

}  // namespace panonav
