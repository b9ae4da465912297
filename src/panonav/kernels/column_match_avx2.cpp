#include "panonav/kernels/column_match_sad.hpp"

namespace panonav::kernels::avx2 {

namespace {

struct Vector {
  using Register = __m256i;
  static constexpr int width = 4;
  static Register zero() { return _mm256_setzero_si256(); }
  static Register repeat(const unsigned char* eight) {
    return _mm256_broadcastq_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(eight)));
  }
  static Register sad(Register a, const unsigned char* b) {
    return _mm256_sad_epu8(a, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(b)));
  }
  static Register add(Register a, Register b) { return _mm256_add_epi32(a, b); }
  static Register beside(Register low, Register high) {
    return _mm256_or_si256(low, _mm256_slli_epi64(high, 32));
  }
  static Register add_root(Register sum, Register l1) {
    const __m256 root = _mm256_sqrt_ps(_mm256_cvtepi32_ps(l1));
    const __m256 rounded =
        _mm256_fmadd_ps(root, _mm256_set1_ps(16.0F), _mm256_set1_ps(root_rounder));
    return _mm256_add_epi32(sum, _mm256_castps_si256(rounded));
  }
  static void store(unsigned int* to, Register a) {
    _mm256_store_si256(reinterpret_cast<__m256i*>(to), a);
  }
};

}  // namespace

void match_columns(const unsigned char* query, const unsigned char* reference,
                   unsigned short* costs) {
  match_columns_by_sad<Vector>(query, reference, costs);
}

}  // namespace panonav::kernels::avx2
