#pragma once

#include <span>
#include <vector>

#include "panonav/core/image.hpp"

namespace panonav {

/// Smoothed channels of an image as float planes, in which circles are searched.
struct SmoothPlanes {
  int width = 0;
  int height = 0;
  std::vector<std::vector<float>> channels;  ///< grey levels 0 .. 255, row-major
  /// Slope, in grey levels per pixel, at which an edge has half of the maximum weight: the 80th
  /// percentile of the slopes of all pixels, at least 1 (8-bit rounding).
  float slope_scale = 1.0F;
  /// Returns the index of pixel (u, v) in each channel.
  [[nodiscard]] std::size_t index(int u, int v) const noexcept {
    return static_cast<std::size_t>(v) * width + u;
  }
};

/// Averages blocks of `reduction` x `reduction` pixels, then smooths with a Gaussian whose standard
/// deviation is `sigma_px` pixels of the reduced image. Throws ContractError on an empty image, or
/// a reduction above its shorter side.
[[nodiscard]] SmoothPlanes make_smooth_planes(ImageView image, int reduction, double sigma_px);

/// Strength and direction of the edge at each pixel: weight * (cos 2t, sin 2t), where t is the
/// angle of the gradient (u right, v down) and the weight is in [0, 1). In colour images the
/// channel with the strongest edge is used. Doubled angles make the polarity of an edge
/// irrelevant, so that fields of several images can be averaged: static edges remain, moving ones
/// average out.
struct EdgeField {
  int width = 0;
  int height = 0;
  std::vector<float> cosine;
  std::vector<float> sine;
  /// Returns the index of pixel (u, v) in both planes.
  [[nodiscard]] std::size_t index(int u, int v) const noexcept {
    return static_cast<std::size_t>(v) * width + u;
  }
};

[[nodiscard]] EdgeField make_edge_field(const SmoothPlanes& planes);

/// Averages fields of equal size. Throws ContractError if there are none, or on different sizes.
[[nodiscard]] EdgeField average_fields(std::span<const EdgeField> fields);

/// Averages blocks of `reduction` x `reduction` pixels.
[[nodiscard]] EdgeField reduce(const EdgeField& field, int reduction);

}  // namespace panonav
