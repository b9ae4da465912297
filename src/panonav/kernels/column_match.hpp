#pragma once

#include <cstdint>
#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Computes, for each rotation s = 0 .. 127, costs[s] = sum over c = 0 .. 31 of round(16 sqrt(L1
/// distance of query column c and reference column (4 c + s) mod 128)). `query` holds 32 columns of
/// 16 bytes, one column after the other; `reference` 16 bands of 128 bytes, one band after the
/// other. Returns the first rotation of the smallest cost. All instruction sets give the same
/// numbers. Throws ContractError on other sizes. Cost: 65,536 absolute differences and 4096 roots.
int match_columns(std::span<const std::uint8_t> query, std::span<const std::uint8_t> reference,
                  std::span<std::uint16_t> costs, Instructions instructions);

/// Computes, for each of 32 columns c of the query, the smallest L1 distance of column 4 c of the
/// query and the columns (4 c + s) mod 128 of the reference, s = turn - 1, turn, turn + 1. `query`
/// and `reference` hold 16 bands of 128 bytes, one band after the other. All instruction sets give
/// the same numbers. Throws ContractError on other sizes. Cost: 2048 absolute differences.
void column_sums_near_turn(std::span<const std::uint8_t> query,
                           std::span<const std::uint8_t> reference, int turn,
                           std::span<std::uint16_t> sums, Instructions instructions);

}  // namespace panonav::kernels
