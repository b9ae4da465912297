#pragma once

#include <span>
#include <string_view>

namespace panonav::kernels {

/// Instruction sets for which kernels have bodies. `avx2` means AVX2 and FMA; `avx512` means F, BW,
/// DQ and VL.
enum class Instructions { scalar, avx2, avx512, neon };

/// "scalar", "avx2", "avx512" or "neon".
[[nodiscard]] std::string_view name(Instructions instructions) noexcept;

/// The sets that this build and this processor have, the widest last; never empty.
[[nodiscard]] std::span<const Instructions> available_instructions() noexcept;

/// The widest available set, or the one named by the environment variable PANONAV_INSTRUCTIONS.
/// Chosen once, at the first call. Throws ContractError when the variable names a set that is
/// unknown or not available.
[[nodiscard]] Instructions chosen_instructions();

}  // namespace panonav::kernels
