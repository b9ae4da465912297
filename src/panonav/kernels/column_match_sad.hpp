#pragma once

// The body of match_columns for instruction sets that add up the absolute differences of eight
// bytes at once. In an unnamed namespace, so that each has a copy of its own.

#include <immintrin.h>

#include "panonav/kernels/column_match_targets.hpp"

namespace panonav::kernels {
namespace {

// Turn s of 4 e + f puts query column c on reference column 4 (c + e) + f: with all columns of one
// f behind each other, neighbouring turns of one f meet neighbouring columns, and all sums stay in
// registers. Columns are there twice, so that no turn has to start again at the front.
constexpr int matched_residues = matched_reference_columns / matched_query_columns;
constexpr int matched_halves = matched_bands / 8;
struct HalvedColumns {
  alignas(64) unsigned char at[matched_residues][matched_halves][2 * matched_query_columns][8];
};

// From 16 bands of 128 bytes each: eight bands of sixteen columns at a time.
inline void halve_columns(const unsigned char* reference, HalvedColumns& halved) {
  for (int half = 0; half < matched_halves; ++half) {
    for (int first = 0; first < matched_reference_columns; first += 16) {
      __m128i rows[8];
      for (int b = 0; b < 8; ++b) {
        rows[b] = _mm_loadu_si128(reinterpret_cast<const __m128i*>(
            reference + (8 * half + b) * matched_reference_columns + first));
      }
      __m128i pairs[8];  // of bands; columns 0 .. 7 and 8 .. 15
      for (int b = 0; b < 4; ++b) {
        pairs[b] = _mm_unpacklo_epi8(rows[2 * b], rows[2 * b + 1]);
        pairs[b + 4] = _mm_unpackhi_epi8(rows[2 * b], rows[2 * b + 1]);
      }
      for (int eight = 0; eight < 2; ++eight) {
        const __m128i* const p = pairs + 4 * eight;
        const __m128i fours[4] = {_mm_unpacklo_epi16(p[0], p[1]), _mm_unpackhi_epi16(p[0], p[1]),
                                  _mm_unpacklo_epi16(p[2], p[3]), _mm_unpackhi_epi16(p[2], p[3])};
        // Columns (0, 1), (2, 3), (4, 5), (6, 7) of these eight.
        const __m128i columns[4] = {
            _mm_unpacklo_epi32(fours[0], fours[2]), _mm_unpackhi_epi32(fours[0], fours[2]),
            _mm_unpacklo_epi32(fours[1], fours[3]), _mm_unpackhi_epi32(fours[1], fours[3])};
        const int e = first / 4 + 2 * eight;
        for (int f = 0; f < matched_residues; ++f) {
          const __m128i low = columns[f / 2];
          const __m128i high = columns[f / 2 + 2];
          const __m128i both =
              f % 2 == 0 ? _mm_unpacklo_epi64(low, high) : _mm_unpackhi_epi64(low, high);
          _mm_store_si128(reinterpret_cast<__m128i*>(halved.at[f][half][e]), both);
          _mm_store_si128(reinterpret_cast<__m128i*>(halved.at[f][half][e + matched_query_columns]),
                          both);
        }
      }
    }
  }
}

// `Vector` holds whole registers: `width` numbers of 64 bit or twice as many of 32.
template <class Vector>
inline void match_columns_by_sad(const unsigned char* query, const unsigned char* reference,
                                 unsigned short* costs) {
  using Register = typename Vector::Register;
  HalvedColumns halved;
  halve_columns(reference, halved);
  for (int first = 0; first < matched_query_columns; first += Vector::width) {
    Register even = Vector::zero();  // turns of f = 0 and 1, side by side
    Register odd = Vector::zero();   // 2 and 3
    for (int c = 0; c < matched_query_columns; ++c) {
      const Register upper = Vector::repeat(query + c * matched_bands);
      const Register lower = Vector::repeat(query + c * matched_bands + 8);
      const auto l1 = [&](int f) {
        return Vector::add(Vector::sad(upper, halved.at[f][0][first + c]),
                           Vector::sad(lower, halved.at[f][1][first + c]));
      };
      even = Vector::add_root(even, Vector::beside(l1(0), l1(1)));
      odd = Vector::add_root(odd, Vector::beside(l1(2), l1(3)));
    }
    alignas(64) unsigned int sums[2][2 * Vector::width];
    Vector::store(sums[0], even);
    Vector::store(sums[1], odd);
    for (int e = 0; e < Vector::width; ++e) {
      for (int f = 0; f < matched_residues; ++f) {
        // Each root came with the bits of the float that rounded it; whole multiples of 65,536.
        costs[4 * (first + e) + f] = static_cast<unsigned short>(sums[f / 2][2 * e + f % 2]);
      }
    }
  }
}

// Adding it rounds to a whole number, which the last bits then hold: 1.5 * 2^23.
constexpr float root_rounder = 12582912.0F;

}  // namespace
}  // namespace panonav::kernels
