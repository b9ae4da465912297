#include <immintrin.h>

#include "panonav/kernels/distance_targets.hpp"

namespace panonav::kernels::avx2 {

namespace {

__m256i load(const void* from) {
  return _mm256_loadu_si256(static_cast<const __m256i*>(from));
}

long long load_group(const uint8_t* from) {
  return *reinterpret_cast<const long long __attribute__((may_alias, aligned(1)))*>(from);
}

int64_t sum_of_lanes(__m256i x) {
  const __m128i pair = _mm_add_epi64(_mm256_castsi256_si128(x), _mm256_extracti128_si256(x, 1));
  return _mm_cvtsi128_si64(pair) + _mm_extract_epi64(pair, 1);
}

}  // namespace

uint32_t l1(const uint8_t* a, const uint8_t* b, size_t count) {
  __m256i sum = _mm256_setzero_si256();
  size_t i = 0;
  for (; i + 32 <= count; i += 32) {
    sum = _mm256_add_epi64(sum, _mm256_sad_epu8(load(a + i), load(b + i)));
  }
  uint32_t total = static_cast<uint32_t>(sum_of_lanes(sum));
  for (; i < count; ++i) total += static_cast<uint32_t>(a[i] > b[i] ? a[i] - b[i] : b[i] - a[i]);
  return total;
}

uint32_t masked_l1(const uint8_t* a, const uint8_t* b, const uint8_t* mask, size_t count) {
  __m256i sum = _mm256_setzero_si256();
  size_t i = 0;
  for (; i + 32 <= count; i += 32) {
    const __m256i m = load(mask + i);
    const __m256i x = _mm256_and_si256(load(a + i), m);
    const __m256i y = _mm256_and_si256(load(b + i), m);
    sum = _mm256_add_epi64(sum, _mm256_sad_epu8(x, y));
  }
  uint32_t total = static_cast<uint32_t>(sum_of_lanes(sum));
  for (; i < count; ++i) {
    const int d = (a[i] & mask[i]) - (b[i] & mask[i]);
    total += static_cast<uint32_t>(d < 0 ? -d : d);
  }
  return total;
}

uint32_t sketch_bounds(const uint8_t* sketches, const int32_t* slacks, size_t octets,
                       const SketchQuery& query, uint32_t* bounds) {
  const __m256i constant = _mm256_set1_epi32(query.constant);
  const __m256i largest = _mm256_set1_epi32(query.largest_slack);
  const __m256i even = _mm256_setr_epi32(0, 2, 4, 6, 0, 2, 4, 6);
  __m256i smallest = _mm256_set1_epi32(-1);
  for (size_t octet = 0; octet < octets; ++octet) {
    __m256i low = _mm256_setzero_si256();
    __m256i high = _mm256_setzero_si256();
    for (size_t group = 0; group < query.groups; ++group) {
      const __m256i m = _mm256_set1_epi64x(load_group(query.mask + group * 8));
      const __m256i q = _mm256_set1_epi64x(load_group(query.values + group * 8));
      const __m256i step = _mm256_set1_epi64x(static_cast<long long>(query.steps[group]));
      const __m256i x = _mm256_and_si256(load(sketches + group * 64), m);
      const __m256i y = _mm256_and_si256(load(sketches + group * 64 + 32), m);
      low = _mm256_add_epi64(low, _mm256_mul_epu32(_mm256_sad_epu8(x, q), step));
      high = _mm256_add_epi64(high, _mm256_mul_epu32(_mm256_sad_epu8(y, q), step));
    }
    sketches += query.stored_groups * 64;
    const __m256i sum = _mm256_blend_epi32(_mm256_permutevar8x32_epi32(low, even),
                                           _mm256_permutevar8x32_epi32(high, even), 0xF0);
    const __m256i slack = _mm256_min_epi32(load(slacks + octet * 8), largest);
    const __m256i bound = _mm256_max_epi32(_mm256_sub_epi32(_mm256_add_epi32(sum, constant), slack),
                                           _mm256_setzero_si256());
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(bounds + octet * 8), bound);
    smallest = _mm256_min_epu32(smallest, bound);
  }
  __m128i four =
      _mm_min_epu32(_mm256_castsi256_si128(smallest), _mm256_extracti128_si256(smallest, 1));
  four = _mm_min_epu32(four, _mm_shuffle_epi32(four, 0x4E));
  four = _mm_min_epu32(four, _mm_shuffle_epi32(four, 0xB1));
  return static_cast<uint32_t>(_mm_cvtsi128_si32(four));
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
    __m256i sum = _mm256_setzero_si256();
    for (size_t group = 0; group < query.groups; group += 4) {
      const __m256i x = _mm256_and_si256(load(sketch + group * 8), load(query.mask + group * 8));
      const __m256i sad = _mm256_sad_epu8(x, load(query.values + group * 8));
      sum = _mm256_add_epi64(sum, _mm256_mul_epu32(sad, load(query.steps + group)));
    }
    const int32_t slack = slacks[indices[i]];
    const int32_t taken = slack < query.largest_slack ? slack : query.largest_slack;
    const int64_t bound = sum_of_lanes(sum) + query.constant - taken;
    bounds[i] = bound < 0 ? 0U : static_cast<uint32_t>(bound);
  }
}

size_t collect_at_most(const uint32_t* values, size_t count, uint32_t limit, uint32_t* indices) {
  const __m256i top = _mm256_set1_epi32(static_cast<int>(limit));
  size_t found = 0;
  size_t i = 0;
  for (; i + 8 <= count; i += 8) {
    const __m256i x = load(values + i);
    const __m256i low = _mm256_cmpeq_epi32(_mm256_min_epu32(x, top), x);
    unsigned bits = static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(low)));
    for (; bits != 0; bits &= bits - 1) {
      indices[found++] = static_cast<uint32_t>(i) + static_cast<uint32_t>(__builtin_ctz(bits));
    }
  }
  for (; i < count; ++i) {
    indices[found] = static_cast<uint32_t>(i);
    found += values[i] <= limit ? 1 : 0;
  }
  return found;
}

}  // namespace panonav::kernels::avx2
