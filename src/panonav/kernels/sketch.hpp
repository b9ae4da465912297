#pragma once

#include <cstdint>
#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Encodes sums as bytes: the code of a sum is the nearest number to (sum - offset) / step, from 0
/// to 255. Writes the codes of group g from codes[g * stride] on, which has room for them. All
/// instruction sets give the same numbers. Throws ContractError unless there are 8 sums for each
/// group of the scale.
[[nodiscard]] EncodedSums encode_sums(std::span<const std::int32_t> sums, const SumScale& scale,
                                      std::uint8_t* codes, std::size_t stride,
                                      Instructions instructions);

}  // namespace panonav::kernels
