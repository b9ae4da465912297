#include <arm_neon.h>

#include "panonav/kernels/remap_vector.hpp"

namespace panonav::kernels::neon {

void halve(const HalveJob& job) {
  for (int v = 0; v < job.height; ++v) {
    const unsigned char* const upper = job.pixels + 2L * v * job.stride;
    const unsigned char* const lower = upper + job.stride;
    unsigned char* const to = job.halved + static_cast<long>(v) * job.width;
    int u = 0;
    for (; u + 8 <= job.width; u += 8) {
      const uint16x8_t sum =
          vpadalq_u8(vpaddlq_u8(vld1q_u8(upper + 2 * u)), vld1q_u8(lower + 2 * u));
      vst1_u8(to + u, vrshrn_n_u16(sum, 2));
    }
    halve_rest(upper, lower, u, job.width, to);
  }
}

void pair_rows(const PairJob& job) {
  for (int v = 0; v < job.height; ++v) {
    const unsigned char* const upper = job.pixels + static_cast<long>(v) * job.stride;
    const unsigned char* const lower = upper + job.stride;
    unsigned short* const to = job.pairs + static_cast<long>(v) * job.width;
    int u = 0;
    for (; u + 16 <= job.width; u += 16) {
      uint8x16x2_t both;
      both.val[0] = vld1q_u8(upper + u);
      both.val[1] = vld1q_u8(lower + u);
      vst2q_u8(reinterpret_cast<unsigned char*>(to + u), both);
    }
    pair_rest(upper, lower, u, job.width, to);
  }
}

void remap(const RemapJob& job) {
  alignas(16) unsigned int pixels[remap_block];
  int i = 0;
  for (; i + remap_block <= job.count; i += remap_block) {
    uint32x4_t sums[remap_block / 4] = {};
    for (long t = 0; t < job.taps; ++t) {
      const long entry = t * job.count + i;
      look_up(job.pairs, job.positions + entry, pixels);
      for (int j = 0; j < remap_block / 4; ++j) {
        const uint8x16_t p = vreinterpretq_u8_u32(vld1q_u32(pixels + 4 * j));
        const uint8x16_t w = vreinterpretq_u8_u32(vld1q_u32(job.weights + entry + 4L * j));
        // Two sums of two for each sample, then one.
        const uint32x4_t low = vpaddlq_u16(vmull_u8(vget_low_u8(p), vget_low_u8(w)));
        const uint32x4_t high = vpaddlq_u16(vmull_high_u8(p, w));
        sums[j] = vaddq_u32(sums[j], vpaddq_u32(low, high));
      }
    }
    for (int j = 0; j < remap_block / 4; ++j) {
      vst1q_f32(job.values + i + 4 * j, vmulq_n_f32(vcvtq_f32_u32(sums[j]), job.scale));
    }
  }
  remap_rest(job, i);
}

}  // namespace panonav::kernels::neon
