#pragma once

#include <cstdint>
#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Computes, for each rotation s = 0 .. 127, costs[s] = sum over c = 0 .. 31 of round(16 sqrt(L1
/// distance of query column c and reference column (4 c + s) mod 128)). `query` holds 32 columns of
/// 16 bytes, one column after the other; `reference` 16 bands of 128 bytes, one band after the
/// other. All instruction sets give the same numbers. Throws ContractError on other sizes. Cost:
/// 65,536 absolute differences and 4096 roots.
void match_columns(std::span<const std::uint8_t> query, std::span<const std::uint8_t> reference,
                   std::span<std::uint16_t> costs, Instructions instructions);

}  // namespace panonav::kernels
