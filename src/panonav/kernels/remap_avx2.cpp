#include <immintrin.h>

#include "panonav/kernels/remap_vector.hpp"

namespace panonav::kernels::avx2 {

namespace {

inline __m256i load(const void* from) {
  return _mm256_loadu_si256(static_cast<const __m256i*>(from));
}

/// 16 means of 2 x 2 pixels, as 16-bit numbers.
inline __m256i means(const unsigned char* upper, const unsigned char* lower) {
  const __m256i ones = _mm256_set1_epi8(1);
  const __m256i sum = _mm256_add_epi16(_mm256_maddubs_epi16(load(upper), ones),
                                       _mm256_maddubs_epi16(load(lower), ones));
  return _mm256_srli_epi16(_mm256_add_epi16(sum, _mm256_set1_epi16(2)), 2);
}

}  // namespace

void halve(const HalveJob& job) {
  for (int v = 0; v < job.height; ++v) {
    const unsigned char* const upper = job.pixels + 2L * v * job.stride;
    const unsigned char* const lower = upper + job.stride;
    unsigned char* const to = job.halved + static_cast<long>(v) * job.width;
    int u = 0;
    for (; u + 32 <= job.width; u += 32) {
      // Packing works within halves of the register; the permutation puts the quarters in order.
      const __m256i packed = _mm256_packus_epi16(means(upper + 2 * u, lower + 2 * u),
                                                 means(upper + 2 * u + 32, lower + 2 * u + 32));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + u),
                          _mm256_permute4x64_epi64(packed, 0xd8));
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
      const __m256i low =
          _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(upper + u)));
      const __m256i high =
          _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(lower + u)));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + u),
                          _mm256_or_si256(low, _mm256_slli_epi16(high, 8)));
    }
    pair_rest(upper, lower, u, job.width, to);
  }
}

void remap(const RemapJob& job) {
  constexpr int lanes = 8;
  const __m256i ones = _mm256_set1_epi16(1);
  const __m256 scale = _mm256_set1_ps(job.scale);
  alignas(64) unsigned int pixels[remap_block];
  int i = 0;
  for (; i + remap_block <= job.count; i += remap_block) {
    __m256i sums[remap_block / lanes] = {};
    for (long t = 0; t < job.taps; ++t) {
      const long entry = t * job.count + i;
      look_up(job.pairs, job.positions + entry, pixels);
      for (int j = 0; j < remap_block / lanes; ++j) {
        // Pixels are unsigned, weights add up to 127: sums of two stay below 2^15.
        const __m256i of_two = _mm256_maddubs_epi16(
            load(pixels + j * lanes), load(job.weights + entry + static_cast<long>(j) * lanes));
        sums[j] = _mm256_add_epi32(sums[j], _mm256_madd_epi16(of_two, ones));
      }
    }
    for (int j = 0; j < remap_block / lanes; ++j) {
      _mm256_storeu_ps(job.values + i + j * lanes,
                       _mm256_mul_ps(scale, _mm256_cvtepi32_ps(sums[j])));
    }
  }
  remap_rest(job, i);
}

}  // namespace panonav::kernels::avx2
