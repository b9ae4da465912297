#pragma once

#include <span>
#include <vector>

#include "panonav/core/image.hpp"

namespace panonav {

/// The smoothed channels of an image as float planes; building block of the search for circles.
struct SmoothPlanes {
  int width = 0;
  int height = 0;
  std::vector<std::vector<float>> channels;  ///< grey levels 0 .. 255, row-major
  /// Edges weaker than about this slope, in grey levels per pixel, count little: the slope that
  /// four fifths of the pixels do not reach, at least 1 (8-bit rounding).
  float slope_scale = 1.0F;
  /// Returns the index of pixel (u, v) in each channel.
  [[nodiscard]] std::size_t index(int u, int v) const noexcept {
    return static_cast<std::size_t>(v) * width + u;
  }
};

/// Averages blocks of `reduction` x `reduction` pixels, then smooths with a Gaussian of `sigma_px`
/// (of the reduced image). Throws ContractError on an empty image or a reduction that leaves
/// nothing.
[[nodiscard]] SmoothPlanes smooth_planes(ImageView image, int reduction, double sigma_px);

/// Strength and direction of the edge through each pixel: weight * (cos 2t, sin 2t), t the angle of
/// the gradient (u right, v down), weight in [0, 1). Of colour images the
/// channel with the strongest edge counts. Doubled angles make the polarity of an edge irrelevant,
/// so fields of several images can be averaged: what stays in its place remains, what moves
/// averages out.
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

/// Mean of fields of one size. Throws ContractError on none or on different sizes.
[[nodiscard]] EdgeField average_fields(std::span<const EdgeField> fields);

/// Averages blocks of `reduction` x `reduction` pixels.
[[nodiscard]] EdgeField reduce(const EdgeField& field, int reduction);

}  // namespace panonav
