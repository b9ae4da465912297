#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "panonav/core/image.hpp"
#include "panonav/kernels/dispatch.hpp"

// Looking up the pixels of an image by a table. All of it is integer arithmetic until the last
// scaling, so every instruction set gives the same bits.

namespace panonav::kernels {

/// Halves width and height of an image of one channel (odd ones are rounded down): each new pixel
/// is the mean of 2 x 2 old ones, halves rounded up. `halved` has room for (width / 2) * (height /
/// 2) bytes, without gaps.
void halve(ImageView image, std::uint8_t* halved, Instructions instructions);

/// Packs each pixel with the one below it into 16 bits: pair v * width + u holds pixel (u, v) in
/// the low byte and (u, v + 1) in the high one; v = 0 .. height - 2. Then the four pixels around
/// any point lie in 32 consecutive bits.
void pair_rows(ImageView image, std::uint16_t* pairs, Instructions instructions);

/// Sum of the four weights of a tap. The weights are bytes, from the low one: (u, v), (u, v + 1),
/// (u + 1, v), (u + 1, v + 1).
inline constexpr int tap_weight_sum = 127;

/// values[i] = scale * sum over t < taps of the weighted mean at pair positions[t * values.size() +
/// i], times tap_weight_sum. Throws ContractError when the tables do not hold taps * values.size()
/// entries. The caller guarantees that each position and the next lie within `pairs`, and that the
/// bytes of a weight add up to at most tap_weight_sum.
void remap(std::span<const std::uint16_t> pairs, std::span<const std::uint32_t> positions,
           std::span<const std::uint32_t> weights, int taps, float scale, std::span<float> values,
           Instructions instructions);

}  // namespace panonav::kernels
