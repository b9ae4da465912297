#include "panonav/kernels/remap.hpp"

#include <string>

#include "panonav/core/error.hpp"
#include "panonav/kernels/remap_targets.hpp"

namespace panonav::kernels {

void halve(Pixels pixels, std::uint8_t* halved, Instructions instructions) {
  const HalveJob job{pixels.data, static_cast<long>(pixels.stride), pixels.width / 2,
                     pixels.height / 2, halved};
  switch (instructions) {
#ifdef PANONAV_HAS_AVX2
    case Instructions::avx2:
      return avx2::halve(job);
#endif
#ifdef PANONAV_HAS_AVX512
    case Instructions::avx512:
      return avx512::halve(job);
#endif
#ifdef PANONAV_HAS_NEON
    case Instructions::neon:
      return neon::halve(job);
#endif
    default:
      return scalar::halve(job);
  }
}

void pair_rows(Pixels pixels, std::uint16_t* pairs, Instructions instructions) {
  const PairJob job{pixels.data, static_cast<long>(pixels.stride), pixels.width, pixels.height - 1,
                    pairs};
  switch (instructions) {
#ifdef PANONAV_HAS_AVX2
    case Instructions::avx2:
      return avx2::pair_rows(job);
#endif
#ifdef PANONAV_HAS_AVX512
    case Instructions::avx512:
      return avx512::pair_rows(job);
#endif
#ifdef PANONAV_HAS_NEON
    case Instructions::neon:
      return neon::pair_rows(job);
#endif
    default:
      return scalar::pair_rows(job);
  }
}

void remap(std::span<const std::uint16_t> pairs, std::span<const std::uint32_t> positions,
           std::span<const std::uint32_t> weights, int taps, float scale, std::span<float> values,
           Instructions instructions) {
  require(taps >= 1, "taps", taps, ">= 1");
  const std::size_t entries = static_cast<std::size_t>(taps) * values.size();
  require(positions.size() == entries, "number of positions", static_cast<double>(positions.size()),
          std::to_string(entries));
  require(weights.size() == entries, "number of weights", static_cast<double>(weights.size()),
          std::to_string(entries));
  const RemapJob job{
      pairs.data(), positions.data(), weights.data(), taps, static_cast<int>(values.size()),
      scale,        values.data()};
  switch (instructions) {
#ifdef PANONAV_HAS_AVX2
    case Instructions::avx2:
      return avx2::remap(job);
#endif
#ifdef PANONAV_HAS_AVX512
    case Instructions::avx512:
      return avx512::remap(job);
#endif
#ifdef PANONAV_HAS_NEON
    case Instructions::neon:
      return neon::remap(job);
#endif
    default:
      return scalar::remap(job);
  }
}

}  // namespace panonav::kernels
