#include "panonav/kernels/internal/vector.hpp"

namespace panonav::kernels {
namespace {

#ifdef __AVX2__
// Rotation s = 4 e + f compares query column c with reference column 4 (c + e) + f. Columns with
// the same f are stored consecutively, so that neighbouring rotations read neighbouring columns and
// all sums stay in registers. The columns are stored twice, so that no index has to wrap.
constexpr int matched_residues = matched_reference_columns / matched_query_columns;
constexpr int matched_halves = matched_bands / 8;
struct TransposedColumns {
  alignas(64) uint8_t at[matched_residues][matched_halves][2 * matched_query_columns][8];
};

// Transposes 16 bands of 128 bytes into `TransposedColumns`, by eight bands and sixteen columns at
// a time.
inline void transpose_columns(const uint8_t* reference, TransposedColumns& transposed) {
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
          _mm_store_si128(reinterpret_cast<__m128i*>(transposed.at[f][half][e]), both);
          _mm_store_si128(
              reinterpret_cast<__m128i*>(transposed.at[f][half][e + matched_query_columns]), both);
        }
      }
    }
  }
}

// Matches columns with the instruction that sums eight absolute differences.
template <Instructions set>
void match_by_sad(const uint8_t* query, const uint8_t* reference, uint16_t* costs) {
  using Vector = ByteVector<set>;
  using Register = typename Vector::Register;
  using Ints = typename Vectors<lanes_of<set>>::Ints;
  using Words = typename Vectors<lanes_of<set>>::Words;  // sums wrap round
  using Floats = typename Vectors<lanes_of<set>>::Floats;
  constexpr int width = sizeof(Register) / sizeof(uint64_t);
  TransposedColumns transposed;
  transpose_columns(reference, transposed);
  for (int first = 0; first < matched_query_columns; first += width) {
    Words sums[2] = {};  // turns of f = 0 and 1, side by side; of 2 and 3
    for (int c = 0; c < matched_query_columns; ++c) {
      const uint8_t* const column = query + c * matched_bands;
      const Register upper = Vector::broadcast(load_group(column));
      const Register lower = Vector::broadcast(load_group(column + 8));
      const auto l1 = [&](int f) {
        return Vector::sad(upper, Vector::load(transposed.at[f][0][first + c])) +
               Vector::sad(lower, Vector::load(transposed.at[f][1][first + c]));
      };
      for (int pair = 0; pair < 2; ++pair) {
        const Register both = l1(2 * pair) | (l1(2 * pair + 1) << 32);
        const Floats root =
            Vector::root(__builtin_convertvector(reinterpret_cast<Ints>(both), Floats));
        // Adding 1.5 * 2^23 rounds to an integer, which is then in the low bits of the float.
        sums[pair] += reinterpret_cast<Words>(root * 16.0F + 12582912.0F);
      }
    }
    for (int e = 0; e < width; ++e) {
      for (int f = 0; f < matched_residues; ++f) {
        // Each summand also contains the bits of the float 1.5 * 2^23, a multiple of 65,536, which
        // the cast removes.
        costs[4 * (first + e) + f] = static_cast<uint16_t>(sums[f / 2][2 * e + f % 2]);
      }
    }
  }
}
#elif defined(__wasm_simd128__)
// Matches columns with the instruction that adds pairs of bytes: two bands lie side by side, so
// that each pair belongs to one column, and all sums stay in registers.
void match_by_pairs(const uint8_t* query, const uint8_t* reference, uint16_t* costs) {
  using Vector = ByteVector<Instructions::simd128>;
  constexpr int columns = matched_reference_columns;
  constexpr int step = columns / matched_query_columns;
  constexpr int pairs = matched_bands / 2;
  alignas(16) uint8_t paired[pairs][2 * columns];
  for (int p = 0; p < pairs; ++p) {
    for (int d = 0; d < columns; d += 16) {
      const v128_t a = wasm_v128_load(reference + 2 * p * columns + d);
      const v128_t b = wasm_v128_load(reference + (2 * p + 1) * columns + d);
      wasm_v128_store(paired[p] + 2 * d, wasm_i8x16_shuffle(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20,
                                                            5, 21, 6, 22, 7, 23));
      wasm_v128_store(paired[p] + 2 * d + 16, wasm_i8x16_shuffle(a, b, 8, 24, 9, 25, 10, 26, 11, 27,
                                                                 12, 28, 13, 29, 14, 30, 15, 31));
    }
  }
  // Adding 1.5 * 2^23 rounds to an integer, which is then in the low bits of the float; a sum of
  // its other bits is a multiple of 65,536, which the cast to a cost removes.
  const auto rounded_root = [](v128_t sums) {
    const v128_t root = wasm_f32x4_sqrt(wasm_f32x4_convert_i32x4(sums));
    return wasm_f32x4_add(wasm_f32x4_mul(root, wasm_f32x4_splat(16.0F)),
                          wasm_f32x4_splat(12582912.0F));
  };
  alignas(16) uint32_t totals[2 * columns] = {};  // at the rotation s: s + columns
  for (int c = 0; c < matched_query_columns; ++c) {
    v128_t values[pairs];
    for (int p = 0; p < pairs; ++p) {
      values[p] = wasm_v128_load16_splat(query + c * matched_bands + 2 * p);
    }
    uint32_t* const shifted_totals = totals + columns - step * c;
    const auto add = [&](int d, v128_t roots) {
      wasm_v128_store(shifted_totals + d,
                      wasm_i32x4_add(wasm_v128_load(shifted_totals + d), roots));
    };
    for (int d = 0; d < columns; d += 8) {
      v128_t sums = wasm_i16x8_splat(0);
#pragma GCC unroll 8
      for (int p = 0; p < pairs; ++p) {
        sums = wasm_i16x8_add(sums, wasm_u16x8_extadd_pairwise_u8x16(Vector::absolute_differences(
                                        wasm_v128_load(paired[p] + 2 * d), values[p])));
      }
      add(d, rounded_root(wasm_u32x4_extend_low_u16x8(sums)));
      add(d + 4, rounded_root(wasm_u32x4_extend_high_u16x8(sums)));
    }
  }
  for (int s = 0; s < columns; ++s) {
    costs[s] = static_cast<uint16_t>(totals[s] + totals[s + columns]);
  }
}
#else
// Loops without branches, which the compiler vectorises.
void match_by_loops(const uint8_t* __restrict query, const uint8_t* __restrict reference,
                    uint16_t* __restrict costs) {
  constexpr int columns = matched_reference_columns;
  constexpr int step = columns / matched_query_columns;
  // Query column c is compared with reference column d at the rotation d - step * c, which is at
  // least -columns + step.
  uint16_t totals[2 * columns] = {};
  for (int c = 0; c < matched_query_columns; ++c) {
    uint16_t sums[columns] = {};
    for (int band = 0; band < matched_bands; ++band) {
      const uint8_t query_value = query[c * matched_bands + band];
      const uint8_t* const reference_band = reference + band * columns;
      for (int d = 0; d < columns; ++d) {
        const uint8_t larger = reference_band[d] > query_value ? reference_band[d] : query_value;
        const uint8_t smaller = reference_band[d] > query_value ? query_value : reference_band[d];
        sums[d] = static_cast<uint16_t>(sums[d] + static_cast<uint8_t>(larger - smaller));
      }
    }
    uint16_t* const shifted_totals = totals + columns - step * c;
    for (int d = 0; d < columns; ++d) {
      // 256 * L1 is an integer below 2^24, and square roots are correctly rounded, so the result is
      // the same on all machines.
      const float root = __builtin_sqrtf(static_cast<float>(static_cast<int>(sums[d]) << 8));
      shifted_totals[d] = static_cast<uint16_t>(shifted_totals[d] + static_cast<int>(root + 0.5F));
    }
  }
  for (int s = 0; s < columns; ++s) {
    costs[s] = static_cast<uint16_t>(totals[s] + totals[s + columns]);
  }
}
#endif

// Packs each cost with its rotation in the low bits, so that one minimum gives both.
int find_smallest(const uint16_t* costs) {
  int smallest = INT32_MAX;
  for (int turn = 0; turn < matched_reference_columns; ++turn) {
    const int packed = costs[turn] * matched_reference_columns + turn;
    smallest = packed < smallest ? packed : smallest;
  }
  return smallest % matched_reference_columns;
}

}  // namespace

template <Instructions set>
int ColumnMatchBody<set>::match_columns(const uint8_t* query, const uint8_t* reference,
                                        uint16_t* costs) {
#ifdef __AVX2__
  match_by_sad<set>(query, reference, costs);
#elif defined(__wasm_simd128__)
  match_by_pairs(query, reference, costs);
#else
  match_by_loops(query, reference, costs);
#endif
  return find_smallest(costs);
}

template <Instructions set>
void ColumnMatchBody<set>::column_sums_near_turn(const uint8_t* __restrict query,
                                                 const uint8_t* __restrict reference, int turn,
                                                 uint16_t* __restrict sums) {
  constexpr int columns = matched_reference_columns;
  constexpr int step = columns / matched_query_columns;
  // The bands twice, so that no index has to wrap.
  uint8_t twice[matched_bands][2 * columns];
  for (int b = 0; b < matched_bands; ++b) {
    __builtin_memcpy(twice[b], reference + b * columns, columns);
    __builtin_memcpy(twice[b] + columns, reference + b * columns, columns);
  }
  const int first = (turn + columns - 1) % columns;
  uint16_t totals[columns] = {};  // of query column c at the rotations first + 0 .. 3: 4 c + 0 .. 3
  for (int b = 0; b < matched_bands; ++b) {
    uint32_t repeated[matched_query_columns];  // the value of a query column, for four rotations
    __builtin_memcpy(repeated, query + b * columns, sizeof repeated);
    for (uint32_t& four : repeated) {
      four &= 255U;  // little endian: the first of four columns
      four |= four << 8U;
      four |= four << 16U;
    }
    uint8_t values[columns];
    __builtin_memcpy(values, repeated, sizeof values);
    const uint8_t* const turned = twice[b] + first;
    for (int d = 0; d < columns; ++d) {
      const uint8_t larger = turned[d] > values[d] ? turned[d] : values[d];
      const uint8_t smaller = turned[d] > values[d] ? values[d] : turned[d];
      totals[d] = static_cast<uint16_t>(totals[d] + static_cast<uint8_t>(larger - smaller));
    }
  }
  for (int c = 0; c < matched_query_columns; ++c) {
    const uint16_t* const at = totals + step * c;
    const uint16_t smaller = at[0] < at[1] ? at[0] : at[1];
    sums[c] = smaller < at[2] ? smaller : at[2];
  }
}

template struct ColumnMatchBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
