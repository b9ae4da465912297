#include "panonav/kernels/dispatch.hpp"

#include <array>
#include <cstddef>
#include <cstdlib>
#include <string>

#include "panonav/core/error.hpp"

namespace panonav::kernels {

namespace {

struct AvailableSets {
  std::array<Instructions, 5> sets{Instructions::scalar};
  std::size_t count = 1;
};

AvailableSets detect_instructions() noexcept {
  AvailableSets available;
#ifdef PANONAV_HAS_AVX2
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    available.sets[available.count++] = Instructions::avx2;
  }
#endif
#ifdef PANONAV_HAS_AVX512
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
    available.sets[available.count++] = Instructions::avx512;
  }
#endif
#ifdef PANONAV_HAS_NEON
  available.sets[available.count++] = Instructions::neon;
#endif
#ifdef PANONAV_HAS_SIMD128
  available.sets[available.count++] = Instructions::simd128;
#endif
  return available;
}

Instructions choose_instructions() {
  const auto sets = available_instructions();
  const char* const forced = std::getenv("PANONAV_INSTRUCTIONS");
  if (forced == nullptr || *forced == '\0') return sets.back();
  std::string allowed;
  for (const Instructions set : sets) {
    if (name(set) == forced) return set;
    allowed += (allowed.empty() ? "" : ", ") + std::string(name(set));
  }
  throw ContractError("PANONAV_INSTRUCTIONS", std::string_view(forced),
                      allowed + " (on this processor)");
}

}  // namespace

std::string_view name(Instructions instructions) noexcept {
  constexpr std::array<std::string_view, 5> names{"scalar", "avx2", "avx512", "neon", "simd128"};
  return names[static_cast<std::size_t>(instructions)];
}

std::span<const Instructions> available_instructions() noexcept {
  static const AvailableSets available = detect_instructions();
  return {available.sets.data(), available.count};
}

Instructions chosen_instructions() {
  static const Instructions chosen = choose_instructions();
  return chosen;
}

}  // namespace panonav::kernels
