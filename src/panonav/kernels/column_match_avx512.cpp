#include "panonav/kernels/column_match_sad.hpp"

namespace panonav::kernels::avx512 {

namespace {

struct Vector {
  using Register = __m512i;
  static constexpr int width = 8;
  static Register zero() { return _mm512_setzero_si512(); }
  static Register repeat(const unsigned char* eight) {
    return _mm512_broadcastq_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(eight)));
  }
  static Register sad(Register a, const unsigned char* b) {
    return _mm512_sad_epu8(a, _mm512_loadu_si512(reinterpret_cast<const __m512i*>(b)));
  }
  static Register add(Register a, Register b) { return _mm512_add_epi32(a, b); }
  static Register beside(Register low, Register high) {
    return _mm512_or_si512(low, _mm512_slli_epi64(high, 32));
  }
  static Register add_root(Register sum, Register l1) {
    const __m512 root = _mm512_sqrt_ps(_mm512_cvtepi32_ps(l1));
    const __m512 rounded =
        _mm512_fmadd_ps(root, _mm512_set1_ps(16.0F), _mm512_set1_ps(root_rounder));
    return _mm512_add_epi32(sum, _mm512_castps_si512(rounded));
  }
  static void store(unsigned int* to, Register a) {
    _mm512_store_si512(reinterpret_cast<__m512i*>(to), a);
  }
};

}  // namespace

void match_columns(const unsigned char* query, const unsigned char* reference,
                   unsigned short* costs) {
  match_columns_by_sad<Vector>(query, reference, costs);
}

}  // namespace panonav::kernels::avx512
