#include "panonav/kernels/remap_targets.hpp"

namespace panonav::kernels::scalar {

void halve(const HalveJob& job) {
  for (int v = 0; v < job.height; ++v) {
    const unsigned char* const upper = job.pixels + 2L * v * job.stride;
    const unsigned char* const lower = upper + job.stride;
    unsigned char* const to = job.halved + static_cast<long>(v) * job.width;
    for (int u = 0; u < job.width; ++u) {
      const int sum = upper[2 * u] + upper[2 * u + 1] + lower[2 * u] + lower[2 * u + 1];
      to[u] = static_cast<unsigned char>((sum + 2) >> 2);
    }
  }
}

void pair_rows(const PairJob& job) {
  for (int v = 0; v < job.height; ++v) {
    const unsigned char* const upper = job.pixels + static_cast<long>(v) * job.stride;
    const unsigned char* const lower = upper + job.stride;
    unsigned short* const to = job.pairs + static_cast<long>(v) * job.width;
    for (int u = 0; u < job.width; ++u) {
      to[u] = static_cast<unsigned short>(upper[u] | (lower[u] << 8));
    }
  }
}

void remap(const RemapJob& job) {
  for (int i = 0; i < job.count; ++i) {
    int sum = 0;
    for (long t = 0; t < job.taps; ++t) {
      const long entry = t * job.count + i;
      const unsigned short* const at = job.pairs + job.positions[entry];
      const unsigned int weights = job.weights[entry];
      sum += static_cast<int>(
          (at[0] & 0xffU) * (weights & 0xffU) + (at[0] >> 8U) * ((weights >> 8U) & 0xffU) +
          (at[1] & 0xffU) * ((weights >> 16U) & 0xffU) + (at[1] >> 8U) * (weights >> 24U));
    }
    job.values[i] = job.scale * static_cast<float>(sum);
  }
}

}  // namespace panonav::kernels::scalar
