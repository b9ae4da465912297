#include <immintrin.h>

#include "panonav/kernels/distance_targets.hpp"

namespace panonav::kernels::avx512 {

namespace {

long long load_group(const uint8_t* from) {
  return *reinterpret_cast<const long long __attribute__((may_alias, aligned(1)))*>(from);
}

// _mm512_reduce_add_epi64 and some conversions make gcc 12 warn of uninitialised values.
int64_t sum_of_lanes(__m512i x) {
  const __m256i four = _mm256_add_epi64(_mm512_maskz_extracti64x4_epi64(0xF, x, 0),
                                        _mm512_maskz_extracti64x4_epi64(0xF, x, 1));
  const __m128i two =
      _mm_add_epi64(_mm256_castsi256_si128(four), _mm256_extracti128_si256(four, 1));
  return _mm_cvtsi128_si64(two) + _mm_extract_epi64(two, 1);
}

}  // namespace

uint32_t l1(const uint8_t* a, const uint8_t* b, size_t count) {
  __m512i sum = _mm512_setzero_si512();
  size_t i = 0;
  for (; i + 64 <= count; i += 64) {
    const __m512i sad = _mm512_sad_epu8(_mm512_loadu_si512(a + i), _mm512_loadu_si512(b + i));
    sum = _mm512_add_epi64(sum, sad);
  }
  if (i < count) {
    const __mmask64 rest = ~__mmask64{0} >> (64 - (count - i));
    const __m512i x = _mm512_maskz_loadu_epi8(rest, a + i);
    const __m512i y = _mm512_maskz_loadu_epi8(rest, b + i);
    sum = _mm512_add_epi64(sum, _mm512_sad_epu8(x, y));
  }
  return static_cast<uint32_t>(sum_of_lanes(sum));
}

uint32_t masked_l1(const uint8_t* a, const uint8_t* b, const uint8_t* mask, size_t count) {
  __m512i sum = _mm512_setzero_si512();
  size_t i = 0;
  for (; i + 64 <= count; i += 64) {
    const __m512i m = _mm512_loadu_si512(mask + i);
    const __m512i x = _mm512_and_si512(_mm512_loadu_si512(a + i), m);
    const __m512i y = _mm512_and_si512(_mm512_loadu_si512(b + i), m);
    sum = _mm512_add_epi64(sum, _mm512_sad_epu8(x, y));
  }
  if (i < count) {
    const __mmask64 rest = ~__mmask64{0} >> (64 - (count - i));
    const __m512i m = _mm512_maskz_loadu_epi8(rest, mask + i);
    const __m512i x = _mm512_and_si512(_mm512_maskz_loadu_epi8(rest, a + i), m);
    const __m512i y = _mm512_and_si512(_mm512_maskz_loadu_epi8(rest, b + i), m);
    sum = _mm512_add_epi64(sum, _mm512_sad_epu8(x, y));
  }
  return static_cast<uint32_t>(sum_of_lanes(sum));
}

namespace {

/// `fixed_groups` > 0: that many groups, whose part of the query then stays in registers.
template <size_t fixed_groups, bool masked>
uint32_t interleaved_bounds(const uint8_t* sketches, const int32_t* slacks, size_t octets,
                            const SketchQuery& query, uint32_t* bounds) {
  constexpr size_t kept = fixed_groups > 0 ? fixed_groups : 1;
  __m512i kept_values[kept];
  __m512i kept_steps[kept];
  for (size_t group = 0; group < fixed_groups; ++group) {
    kept_values[group] = _mm512_set1_epi64(load_group(query.values + group * 8));
    kept_steps[group] = _mm512_set1_epi64(static_cast<long long>(query.steps[group]));
  }
  const size_t groups = fixed_groups > 0 ? fixed_groups : query.groups;
  const __m256i constant = _mm256_set1_epi32(query.constant);
  const __m256i largest = _mm256_set1_epi32(query.largest_slack);
  __m256i smallest = _mm256_set1_epi32(-1);
  for (size_t octet = 0; octet < octets; ++octet) {
    __m512i sum = _mm512_setzero_si512();
    for (size_t group = 0; group < groups; ++group) {
      const __m512i q = fixed_groups > 0 ? kept_values[group]
                                         : _mm512_set1_epi64(load_group(query.values + group * 8));
      const __m512i step = fixed_groups > 0
                               ? kept_steps[group]
                               : _mm512_set1_epi64(static_cast<long long>(query.steps[group]));
      __m512i x = _mm512_loadu_si512(sketches + group * 64);
      if (masked) {
        x = _mm512_and_si512(x, _mm512_set1_epi64(load_group(query.mask + group * 8)));
      }
      sum = _mm512_add_epi64(sum, _mm512_maskz_mul_epu32(0xFF, _mm512_sad_epu8(x, q), step));
    }
    sketches += query.stored_groups * 64;
    const __m256i slack = _mm256_min_epi32(
        _mm256_loadu_si256(reinterpret_cast<const __m256i*>(slacks + octet * 8)), largest);
    __m256i bound = _mm256_add_epi32(_mm512_maskz_cvtepi64_epi32(0xFF, sum), constant);
    bound = _mm256_max_epi32(_mm256_sub_epi32(bound, slack), _mm256_setzero_si256());
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(bounds + octet * 8), bound);
    smallest = _mm256_min_epu32(smallest, bound);
  }
  __m128i four =
      _mm_min_epu32(_mm256_castsi256_si128(smallest), _mm256_extracti128_si256(smallest, 1));
  four = _mm_min_epu32(four, _mm_shuffle_epi32(four, 0x4E));
  four = _mm_min_epu32(four, _mm_shuffle_epi32(four, 0xB1));
  return static_cast<uint32_t>(_mm_cvtsi128_si32(four));
}

bool counts_everywhere(const SketchQuery& query) {
  for (size_t group = 0; group < query.groups; ++group) {
    if (load_group(query.mask + group * 8) != -1) return false;
  }
  return true;
}

}  // namespace

uint32_t sketch_bounds(const uint8_t* sketches, const int32_t* slacks, size_t octets,
                       const SketchQuery& query, uint32_t* bounds) {
  // 15 components make 5 groups; other shapes take the general body.
  if (query.groups == 5 && counts_everywhere(query)) {
    return interleaved_bounds<5, false>(sketches, slacks, octets, query, bounds);
  }
  return interleaved_bounds<0, true>(sketches, slacks, octets, query, bounds);
}

void sketch_bounds_at(const uint8_t* sketches, const int32_t* slacks, const uint32_t* indices,
                      size_t count, const SketchQuery& query, uint32_t* bounds) {
  constexpr size_t ahead = 8;
  for (size_t i = 0; i < count; ++i) {
    if (i + ahead < count) {
      const uint8_t* const next = sketches + indices[i + ahead] * query.stored_groups * 8;
      for (size_t group = 0; group < query.groups; group += 8)
        _mm_prefetch(next + group * 8, _MM_HINT_T0);
    }
    const uint8_t* const sketch = sketches + indices[i] * query.stored_groups * 8;
    __m512i sum = _mm512_setzero_si512();
    for (size_t group = 0; group < query.groups; group += 8) {
      const __m512i m = _mm512_loadu_si512(query.mask + group * 8);
      const __m512i x = _mm512_and_si512(_mm512_loadu_si512(sketch + group * 8), m);
      const __m512i sad = _mm512_sad_epu8(x, _mm512_loadu_si512(query.values + group * 8));
      const __m512i steps = _mm512_loadu_si512(query.steps + group);
      sum = _mm512_add_epi64(sum, _mm512_maskz_mul_epu32(0xFF, sad, steps));
    }
    const int32_t slack = slacks[indices[i]];
    const int32_t taken = slack < query.largest_slack ? slack : query.largest_slack;
    const int64_t bound = sum_of_lanes(sum) + query.constant - taken;
    bounds[i] = bound < 0 ? 0U : static_cast<uint32_t>(bound);
  }
}

size_t collect_at_most(const uint32_t* values, size_t count, uint32_t limit, uint32_t* indices) {
  const __m512i top = _mm512_set1_epi32(static_cast<int>(limit));
  __m512i index = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  size_t found = 0;
  for (size_t i = 0; i < count; i += 16) {
    const __mmask16 there = count - i >= 16 ? static_cast<__mmask16>(0xFFFF)
                                            : static_cast<__mmask16>(0xFFFFU >> (16 - (count - i)));
    const __m512i x = _mm512_maskz_loadu_epi32(there, values + i);
    const __mmask16 low = _mm512_mask_cmple_epu32_mask(there, x, top);
    if (low != 0) {
      _mm512_storeu_si512(indices + found, _mm512_maskz_compress_epi32(low, index));
      found += static_cast<size_t>(__builtin_popcount(low));
    }
    index = _mm512_add_epi32(index, _mm512_set1_epi32(16));
  }
  return found;
}

}  // namespace panonav::kernels::avx512
