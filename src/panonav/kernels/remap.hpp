#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "panonav/core/image.hpp"
#include "panonav/kernels/dispatch.hpp"

// Resampling of images by tables of positions and weights. All arithmetic up to the final scaling
// is in integers, so results are bit-identical for all instruction sets.

namespace panonav::kernels {

/// Halves width and height of an image of one channel (odd ones are rounded down): each new pixel
/// is the mean of 2 x 2 old ones, halves rounded up. `halved` has room for (width / 2) * (height /
/// 2) bytes, without gaps.
void halve(ImageView image, std::uint8_t* halved, Instructions instructions);

/// Packs each pixel with the one below it into 16 bits: pair v * width + u holds pixel (u, v) in
/// the low byte and (u, v + 1) in the high one; v = 0 .. height - 2. The four pixels around any
/// point are then 32 consecutive bits, read by one load.
void pair_rows(ImageView image, std::uint16_t* pairs, Instructions instructions);

/// Sum of the four weights of a tap. The weights are bytes of a word, from the low byte: (u, v),
/// (u, v + 1), (u + 1, v), (u + 1, v + 1).
inline constexpr int tap_weight_sum = 127;

/// Computes values[i] = scale * the sum, over t < taps, of the four pixels at positions[e] times
/// their weights in weights[e], where e = t * values.size() + i. Throws ContractError when the
/// tables do not hold taps * values.size() entries. The caller guarantees that each position and
/// the next lie within `pairs`, and that the bytes of a weight add up to at most tap_weight_sum.
void remap(std::span<const std::uint16_t> pairs, std::span<const std::uint32_t> positions,
           std::span<const std::uint32_t> weights, int taps, float scale, std::span<float> values,
           Instructions instructions);

}  // namespace panonav::kernels
