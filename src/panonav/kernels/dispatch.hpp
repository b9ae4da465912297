#pragma once

#include <span>
#include <string_view>

#include "panonav/kernels/types.hpp"

namespace panonav::kernels {

/// Returns "scalar", "avx2", "avx512", "neon" or "simd128".
[[nodiscard]] std::string_view name(Instructions instructions) noexcept;

/// Lists the instruction sets that both this build and this processor support, the widest last;
/// never empty.
[[nodiscard]] std::span<const Instructions> available_instructions() noexcept;

/// Returns the widest available set, or the one named by the environment variable
/// PANONAV_INSTRUCTIONS; the choice is made once, at the first call. Throws ContractError when the
/// variable names a set that is unknown or not available.
[[nodiscard]] Instructions chosen_instructions();

}  // namespace panonav::kernels
