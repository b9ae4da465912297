#pragma once

#include <cstdint>
#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Finds, for each descriptor of `a` (four words of 64 bits), the index of the nearest
/// descriptor of `b` by Hamming distance, and vice versa; of equally near ones the first. If one
/// list is empty, the results of the other are not written. Throws ContractError on inconsistent
/// sizes and on more than `max_descriptors` descriptors.
void nearest_descriptors(std::span<const std::uint64_t> a, std::span<const std::uint64_t> b,
                         std::span<std::uint16_t> nearest_of_a,
                         std::span<std::uint16_t> nearest_of_b, Instructions instructions);

/// Counts, for each direction of motion, the matched bearings that it explains after the reference
/// has been rotated by `turn` (docs/equations.md, Local features): `counts[d]` for axis d and
/// `counts[d + motion_axes]` for the opposite direction. Bearings that are a right angle or more
/// apart after this rotation are not counted. All instruction sets give the same numbers. Throws
/// ContractError on sizes that do not fit.
void count_explained(const MatchedBearings& matched, const MatchedBearings::Turn& turn,
                     const MotionHypotheses& hypotheses, std::span<std::int32_t> counts,
                     Instructions instructions);

}  // namespace panonav::kernels
