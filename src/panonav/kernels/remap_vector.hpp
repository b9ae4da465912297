#pragma once

// What the vector bodies of remap.hpp share: the parts that have no vector instruction or gain
// nothing from one. In an unnamed namespace, so that each instruction set has a copy of its own.

#include "panonav/kernels/remap_targets.hpp"

namespace panonav::kernels {
namespace {

/// Samples that are looked up together. Measured: ordinary loads through a buffer of this length
/// beat the gather instructions of AVX2 and AVX-512, and NEON has none.
constexpr int remap_block = 64;

/// The four pixels of each of `remap_block` taps.
inline void look_up(const unsigned short* pairs, const unsigned int* positions,
                    unsigned int* pixels) {
  static_assert(sizeof(unsigned long long) == 2 * sizeof(unsigned int));
#pragma GCC unroll 8
  for (int i = 0; i < remap_block; i += 2) {
    unsigned long long two;  // one load for two positions; both machines are little endian
    __builtin_memcpy(&two, positions + i, sizeof two);
    __builtin_memcpy(pixels + i, pairs + static_cast<unsigned int>(two), sizeof *pixels);
    __builtin_memcpy(pixels + i + 1, pairs + (two >> 32U), sizeof *pixels);
  }
}

inline void remap_rest(const RemapJob& job, int first) {
  for (int i = first; i < job.count; ++i) {
    int sum = 0;
    for (long t = 0; t < job.taps; ++t) {
      const long entry = t * job.count + i;
      unsigned int pixels;
      __builtin_memcpy(&pixels, job.pairs + job.positions[entry], sizeof pixels);
      const unsigned int weights = job.weights[entry];
      for (unsigned int byte = 0; byte < 32; byte += 8) {
        sum += static_cast<int>(((pixels >> byte) & 0xffU) * ((weights >> byte) & 0xffU));
      }
    }
    job.values[i] = job.scale * static_cast<float>(sum);
  }
}

inline void halve_rest(const unsigned char* upper, const unsigned char* lower, int first, int width,
                       unsigned char* to) {
  for (int u = first; u < width; ++u) {
    const int sum = upper[2 * u] + upper[2 * u + 1] + lower[2 * u] + lower[2 * u + 1];
    to[u] = static_cast<unsigned char>((sum + 2) >> 2);
  }
}

inline void pair_rest(const unsigned char* upper, const unsigned char* lower, int first, int width,
                      unsigned short* to) {
  for (int u = first; u < width; ++u) {
    to[u] = static_cast<unsigned short>(upper[u] | (lower[u] << 8));
  }
}

}  // namespace
}  // namespace panonav::kernels
