#pragma once

#include <cstdint>
#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// For each descriptor of `a`, four words of 64 bits, the number of the nearest one of `b` by
/// Hamming distance, and the reverse; of equally near ones the first. Entries where the other list
/// is empty keep their value. Throws ContractError on sizes that do not fit and more than
/// `max_descriptors`.
void nearest_descriptors(std::span<const std::uint64_t> a, std::span<const std::uint64_t> b,
                         std::span<std::uint16_t> nearest_of_a,
                         std::span<std::uint16_t> nearest_of_b, Instructions instructions);

/// Counts for each direction of motion how many matched bearings it explains (docs/equations.md,
/// Local features): `counts[d]` for `directions[2 d]`, `directions[2 d + 1]`, the cosine and the
/// sine of direction d. All instruction sets give the same numbers. Throws ContractError on sizes
/// that do not fit.
void count_explained(std::span<const BearingLane> lanes, std::span<const float> directions,
                     float square_tolerance, std::span<std::int32_t> counts,
                     Instructions instructions);

}  // namespace panonav::kernels
