#pragma once

#include <cstdint>
#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Finds for each descriptor of `a`, four words of 64 bits, the index of the nearest one of `b` by
/// Hamming distance, and the reverse; of equally near ones the first. Entries where the other list
/// is empty keep their value. Throws ContractError on sizes that do not fit and more than
/// `max_descriptors`.
void nearest_descriptors(std::span<const std::uint64_t> a, std::span<const std::uint64_t> b,
                         std::span<std::uint16_t> nearest_of_a,
                         std::span<std::uint16_t> nearest_of_b, Instructions instructions);

/// Counts for each direction of motion how many matched bearings it explains after the reference
/// has been turned by `turn` (docs/equations.md, Local features): `counts[d]` for axis d and
/// `counts[d + motion_axes]` for its opposite. Bearings that the turn leaves a right angle or more
/// apart do not count. All instruction sets give the same numbers. Throws ContractError on sizes
/// that do not fit.
void count_explained(const MatchedBearings& matched, const MatchedBearings::Turn& turn,
                     const MotionHypotheses& hypotheses, std::span<std::int32_t> counts,
                     Instructions instructions);

}  // namespace panonav::kernels
