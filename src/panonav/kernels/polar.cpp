#include "panonav/kernels/polar.hpp"

#include <string>

#include "panonav/core/error.hpp"
#include "panonav/kernels/polar_targets.hpp"

namespace panonav::kernels {

void to_polar(std::span<const float> real, std::span<const float> imaginary,
              std::span<float> magnitudes, std::span<float> phases_rad, Instructions instructions) {
  for (const std::size_t size : {imaginary.size(), magnitudes.size(), phases_rad.size()}) {
    require(size == real.size(), "number of values", static_cast<double>(size),
            std::to_string(real.size()) + " (as of real parts)");
  }
  const PolarJob job{real.data(), imaginary.data(), magnitudes.data(), phases_rad.data(),
                     static_cast<int>(real.size())};
  switch (instructions) {
#ifdef PANONAV_HAS_AVX2
    case Instructions::avx2:
      return avx2::to_polar(job);
#endif
#ifdef PANONAV_HAS_AVX512
    case Instructions::avx512:
      return avx512::to_polar(job);
#endif
#ifdef PANONAV_HAS_NEON
    case Instructions::neon:
      return neon::to_polar(job);
#endif
    default:
      return scalar::to_polar(job);
  }
}

}  // namespace panonav::kernels
