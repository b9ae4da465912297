#include "panonav/kernels/distance.hpp"

#define PANONAV_DISTANCE_KERNELS(target)                                            \
  {                                                                                 \
    target::l1, target::masked_l1, target::sketch_bounds, target::sketch_bounds_at, \
        target::collect_at_most                                                     \
  }

namespace panonav::kernels {

const DistanceKernels& distance_kernels(Instructions instructions) {
  static constexpr DistanceKernels scalar_kernels = PANONAV_DISTANCE_KERNELS(scalar);
#ifdef PANONAV_HAS_AVX2
  static constexpr DistanceKernels avx2_kernels = PANONAV_DISTANCE_KERNELS(avx2);
  if (instructions == Instructions::avx2) return avx2_kernels;
#endif
#ifdef PANONAV_HAS_AVX512
  static constexpr DistanceKernels avx512_kernels = PANONAV_DISTANCE_KERNELS(avx512);
  if (instructions == Instructions::avx512) return avx512_kernels;
#endif
#ifdef PANONAV_HAS_NEON
  static constexpr DistanceKernels neon_kernels = PANONAV_DISTANCE_KERNELS(neon);
  if (instructions == Instructions::neon) return neon_kernels;
#endif
  static_cast<void>(instructions);
  return scalar_kernels;
}

}  // namespace panonav::kernels
