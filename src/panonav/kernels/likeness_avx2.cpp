#include "panonav/kernels/likeness_vector.hpp"

namespace panonav::kernels::avx2 {

void explain_likeness(const LikenessLanes& lanes, const LikenessFall& fall, const float* x_m,
                      const float* y_m, const float* heading_rad, float* explained, int count) {
  explain_likeness_loop(lanes, fall, x_m, y_m, heading_rad, explained, count);
}

void exponentials(const float* logarithms, float scale, float* values, int count) {
  exponentials_loop(logarithms, scale, values, count);
}

}  // namespace panonav::kernels::avx2
