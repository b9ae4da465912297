#include <immintrin.h>

#include "panonav/kernels/remap_vector.hpp"

namespace panonav::kernels::avx512 {

void halve(const HalveJob& job) {
  const __m512i ones = _mm512_set1_epi8(1);
  const __m512i half = _mm512_set1_epi16(2);
  for (int v = 0; v < job.height; ++v) {
    const unsigned char* const upper = job.pixels + 2L * v * job.stride;
    const unsigned char* const lower = upper + job.stride;
    unsigned char* const to = job.halved + static_cast<long>(v) * job.width;
    int u = 0;
    for (; u + 32 <= job.width; u += 32) {
      const __m512i sum =
          _mm512_add_epi16(_mm512_maddubs_epi16(_mm512_loadu_si512(upper + 2 * u), ones),
                           _mm512_maddubs_epi16(_mm512_loadu_si512(lower + 2 * u), ones));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + u),
                          _mm512_cvtepi16_epi8(_mm512_srli_epi16(_mm512_add_epi16(sum, half), 2)));
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
    for (; u + 32 <= job.width; u += 32) {
      const __m512i low =
          _mm512_cvtepu8_epi16(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(upper + u)));
      const __m512i high =
          _mm512_cvtepu8_epi16(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(lower + u)));
      _mm512_storeu_si512(to + u, _mm512_or_si512(low, _mm512_slli_epi16(high, 8)));
    }
    pair_rest(upper, lower, u, job.width, to);
  }
}

void remap(const RemapJob& job) {
  constexpr int lanes = 16;
  const __m512i ones = _mm512_set1_epi16(1);
  const __m512 scale = _mm512_set1_ps(job.scale);
  alignas(64) unsigned int pixels[remap_block];
  int i = 0;
  for (; i + remap_block <= job.count; i += remap_block) {
    __m512i sums[remap_block / lanes] = {};
    for (long t = 0; t < job.taps; ++t) {
      const long entry = t * job.count + i;
      look_up(job.pairs, job.positions + entry, pixels);
      for (int j = 0; j < remap_block / lanes; ++j) {
        // Pixels are unsigned, weights add up to 127: sums of two stay below 2^15.
        const __m512i of_two = _mm512_maddubs_epi16(
            _mm512_load_si512(pixels + j * lanes),
            _mm512_loadu_si512(job.weights + entry + static_cast<long>(j) * lanes));
        sums[j] = _mm512_add_epi32(sums[j], _mm512_madd_epi16(of_two, ones));
      }
    }
    for (int j = 0; j < remap_block / lanes; ++j) {
      _mm512_storeu_ps(job.values + i + j * lanes,
                       _mm512_mul_ps(scale, _mm512_cvtepi32_ps(sums[j])));
    }
  }
  remap_rest(job, i);
}

}  // namespace panonav::kernels::avx512
