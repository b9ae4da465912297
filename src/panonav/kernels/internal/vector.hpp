#pragma once

// Vector types and operations of one instruction set. They are in an unnamed namespace, so that
// each compiled body has its own copy for its set.

#include "panonav/kernels/internal/bodies.hpp"

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

namespace panonav::kernels {
namespace {

/// Vectors of `lanes` numbers of 32 bits, with the vector extension of GCC and Clang.
template <int lanes>
struct Vectors {
  typedef float Floats __attribute__((vector_size(4 * lanes)));
  typedef float UnalignedFloats __attribute__((vector_size(4 * lanes), aligned(4)));
  typedef int32_t Ints __attribute__((vector_size(4 * lanes)));
  typedef uint32_t Words __attribute__((vector_size(4 * lanes)));
  typedef int64_t Longs __attribute__((vector_size(4 * lanes)));
};

template <Instructions set>
constexpr int lanes_of = set == Instructions::avx512 ? 16
                         : set == Instructions::avx2 ? 8
                                                     : 4;

// Operations of a ByteVector on bytes and images:
//   load(from)             from any address
//   halve(upper, lower, to)   `halved` means of 2 x 2 bytes, halves rounded up
//   lookup(table, bytes), lookup_upper(table, bytes)    of each byte the entry of a table of 16
//                          bytes at its lower, its upper four bits
//   add_saturated(a, b)    of each byte the sum, at most 255
//   at_most(a, limit)      bit i: byte i is at most the limit
//   collect(values, limit, first, to)    of sizeof(Register) / 4 values those <= limit: writes
//                          first + position, may write as many as there are values; their number

// Operations on groups of eight bytes and on numbers:
//   repeat(number)         in each group
//   sad(a, b)              of each group the sum of the absolute differences of its bytes
//   add_sad(sums, a, b)    the same added to sums of which only the total counts
//   total(sums)            of all numbers; below 2^32
//   product(a, b)          of each group; factors below 2^32
//   smaller(a, b)          of each number of 32 bits the smaller one, unsigned; not of all sets
//   narrow(sums, eight)    the eight numbers of 64 / sizeof(Register) registers, each below 2^32
//   add_products(sums, bytes, weights)   adds to each number of 32 bits its four bytes times their
//                          weights, which add up to at most 127

/// Operations that compilers do not generate from loops. A Register holds groups of eight bytes,
/// each of which is also a 64-bit number (for `+` and `&`) or two 32-bit numbers.
template <Instructions set>
struct ByteVector;

typedef int32_t EightInts __attribute__((vector_size(32), aligned(4)));

inline uint64_t load_group(const void* from) {
  uint64_t group;
  __builtin_memcpy(&group, from, sizeof group);
  return group;
}

inline size_t write_set_bit_positions(unsigned bits, uint32_t first, uint32_t* to) {
  size_t count = 0;
  for (; bits != 0; bits &= bits - 1) {
    to[count++] = first + static_cast<uint32_t>(__builtin_ctz(bits));
  }
  return count;
}

template <>
struct ByteVector<Instructions::scalar> {
  using Register = uint64_t;
  typedef uint8_t Octet __attribute__((vector_size(8)));
  static Register load(const void* from) { return load_group(from); }
  static Register broadcast(uint64_t number) { return number; }
  static Register sad(Register a, Register b) {
    Octet x;
    Octet y;
    __builtin_memcpy(&x, &a, sizeof x);
    __builtin_memcpy(&y, &b, sizeof y);
    const Octet differences = (x > y ? x : y) - (x > y ? y : x);
    uint64_t bytes;
    __builtin_memcpy(&bytes, &differences, sizeof bytes);
    // Four sums of two bytes, 16 bits each; the multiplication adds them in the highest 16 bits.
    constexpr uint64_t every_other = 0x00FF00FF00FF00FFU;
    const uint64_t sums = (bytes & every_other) + ((bytes >> 8U) & every_other);
    return (sums * 0x0001000100010001U) >> 48U;
  }
  static Register add_sad(Register sums, Register a, Register b) { return sums + sad(a, b); }
  static uint64_t total(Register sums) { return sums; }
  static Register product(Register a, Register b) { return a * b; }
  static void narrow(const Register* sums, EightInts& eight) {
    int32_t each[8];
    for (int i = 0; i < 8; ++i) each[i] = static_cast<int32_t>(sums[i]);
    __builtin_memcpy(&eight, each, sizeof each);
  }
};

#ifdef __AVX2__
template <>
struct ByteVector<Instructions::avx2> {
  using Register = __m256i;
  static Register load(const void* from) {
    return _mm256_loadu_si256(static_cast<const Register*>(from));
  }
  static Register broadcast(uint64_t number) {
    return _mm256_set1_epi64x(static_cast<long long>(number));
  }
  static Register sad(Register a, Register b) { return _mm256_sad_epu8(a, b); }
  static Register add_sad(Register sums, Register a, Register b) { return sums + sad(a, b); }
  static uint64_t total(Register sums) {
    const __m128i two = _mm256_castsi256_si128(sums) + _mm256_extracti128_si256(sums, 1);
    return static_cast<uint64_t>(two[0] + two[1]);
  }
  static Register product(Register a, Register b) { return _mm256_mul_epu32(a, b); }
  static Register smaller(Register a, Register b) { return _mm256_min_epu32(a, b); }
  static void narrow(const Register* sums, EightInts& eight) {
    const Register even = _mm256_setr_epi32(0, 2, 4, 6, 0, 2, 4, 6);
    const Register low = _mm256_permutevar8x32_epi32(sums[0], even);
    const Register high = _mm256_permutevar8x32_epi32(sums[1], even);
    eight = reinterpret_cast<EightInts>(_mm256_blend_epi32(low, high, 0xF0));
  }
  static Register add_products(Register sums, Register bytes, Register weights) {
    const Register of_two = _mm256_maddubs_epi16(bytes, weights);
    return _mm256_add_epi32(sums, _mm256_madd_epi16(of_two, _mm256_set1_epi16(1)));
  }
  static size_t collect(const uint32_t* values, uint32_t limit, uint32_t first, uint32_t* to) {
    const Register x = load(values);
    const Register top = _mm256_set1_epi32(static_cast<int>(limit));
    const Register low = _mm256_cmpeq_epi32(_mm256_min_epu32(x, top), x);
    return write_set_bit_positions(
        static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(low))), first, to);
  }
  static Register broadcast_table(const uint8_t* table) {
    return _mm256_broadcastsi128_si256(_mm_loadu_si128(reinterpret_cast<const __m128i*>(table)));
  }
  static Register lookup(const uint8_t* table, Register bytes) {
    return _mm256_shuffle_epi8(broadcast_table(table), bytes & _mm256_set1_epi8(15));
  }
  static Register lookup_upper(const uint8_t* table, Register bytes) {
    return lookup(table, _mm256_srli_epi16(bytes, 4));
  }
  static Register add_saturated(Register a, Register b) { return _mm256_adds_epu8(a, b); }
  static uint64_t at_most(Register a, uint8_t limit) {
    const Register top = _mm256_set1_epi8(static_cast<char>(limit));
    return static_cast<uint32_t>(
        _mm256_movemask_epi8(_mm256_cmpeq_epi8(_mm256_min_epu8(a, top), a)));
  }
  static constexpr int halved = 32;
  static void halve(const uint8_t* upper, const uint8_t* lower, uint8_t* to) {
    const auto means = [&](int at) {
      const Register ones = _mm256_set1_epi8(1);
      const Register sum = _mm256_add_epi16(_mm256_maddubs_epi16(load(upper + at), ones),
                                            _mm256_maddubs_epi16(load(lower + at), ones));
      return _mm256_srli_epi16(_mm256_add_epi16(sum, _mm256_set1_epi16(2)), 2);
    };
    // The pack instruction works on each half of the register separately; the permutation restores
    // the order of the quarters.
    const Register packed =
        _mm256_permute4x64_epi64(_mm256_packus_epi16(means(0), means(32)), 0xd8);
    __builtin_memcpy(to, &packed, sizeof packed);
  }
  static __m256 root(__m256 a) { return _mm256_sqrt_ps(a); }
};
#endif

#ifdef __AVX512BW__
template <>
struct ByteVector<Instructions::avx512> {
  using Register = __m512i;
  static Register load(const void* from) { return _mm512_loadu_si512(from); }
  /// Loads the first `count` bytes, 1 .. 63, and fills the rest with zeros.
  static Register load_first(const void* from, size_t count) {
    return _mm512_maskz_loadu_epi8(~__mmask64{0} >> (64 - count), from);
  }
  static Register broadcast(uint64_t number) {
    return _mm512_set1_epi64(static_cast<long long>(number));
  }
  static Register sad(Register a, Register b) { return _mm512_sad_epu8(a, b); }
  static Register add_sad(Register sums, Register a, Register b) { return sums + sad(a, b); }
  // _mm512_reduce_add_epi64 and some conversions make gcc 12 warn of uninitialised values.
  static uint64_t total(Register sums) {
    return ByteVector<Instructions::avx2>::total(_mm512_maskz_extracti64x4_epi64(0xF, sums, 0) +
                                                 _mm512_maskz_extracti64x4_epi64(0xF, sums, 1));
  }
  static Register product(Register a, Register b) { return _mm512_maskz_mul_epu32(0xFF, a, b); }
  static Register smaller(Register a, Register b) { return _mm512_maskz_min_epu32(0xFFFF, a, b); }
  static void narrow(const Register* sums, EightInts& eight) {
    eight = reinterpret_cast<EightInts>(_mm512_maskz_cvtepi64_epi32(0xFF, sums[0]));
  }
  static Register add_products(Register sums, Register bytes, Register weights) {
    const Register of_two = _mm512_maddubs_epi16(bytes, weights);
    return _mm512_add_epi32(sums, _mm512_madd_epi16(of_two, _mm512_set1_epi16(1)));
  }
  /// Interleaves 32 bytes of a row with those of the row below; on other sets a plain loop is
  /// equally fast.
  static void pair(const uint8_t* upper, const uint8_t* lower, uint16_t* to) {
    const auto widened = [](const uint8_t* from) {
      return _mm512_cvtepu8_epi16(ByteVector<Instructions::avx2>::load(from));
    };
    _mm512_storeu_si512(to, widened(upper) | _mm512_slli_epi16(widened(lower), 8));
  }
  static size_t collect(const uint32_t* values, uint32_t limit, uint32_t first, uint32_t* to) {
    const __mmask16 low =
        _mm512_cmple_epu32_mask(load(values), _mm512_set1_epi32(static_cast<int>(limit)));
    if (low == 0) return 0;
    const Register positions =
        _mm512_add_epi32(_mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15),
                         _mm512_set1_epi32(static_cast<int>(first)));
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(low, positions));
    return static_cast<size_t>(_mm_popcnt_u64(low));
  }
  static Register lookup(const uint8_t* table, Register bytes) {
    const __m128i entries = _mm_loadu_si128(reinterpret_cast<const __m128i*>(table));
    return _mm512_shuffle_epi8(_mm512_maskz_broadcast_i32x4(0xFFFF, entries),
                               bytes & _mm512_set1_epi8(15));
  }
  static Register lookup_upper(const uint8_t* table, Register bytes) {
    return lookup(table, _mm512_srli_epi16(bytes, 4));
  }
  static Register add_saturated(Register a, Register b) { return _mm512_adds_epu8(a, b); }
  static uint64_t at_most(Register a, uint8_t limit) {
    return _mm512_cmple_epu8_mask(a, _mm512_set1_epi8(static_cast<char>(limit)));
  }
  static constexpr int halved = 32;
  static void halve(const uint8_t* upper, const uint8_t* lower, uint8_t* to) {
    const Register ones = _mm512_set1_epi8(1);
    const Register sum = _mm512_add_epi16(_mm512_maddubs_epi16(load(upper), ones),
                                          _mm512_maddubs_epi16(load(lower), ones));
    const __m256i means =
        _mm512_cvtepi16_epi8(_mm512_srli_epi16(_mm512_add_epi16(sum, _mm512_set1_epi16(2)), 2));
    __builtin_memcpy(to, &means, sizeof means);
  }
  static __m512 root(__m512 a) { return _mm512_sqrt_ps(a); }
};
#endif

#ifdef __ARM_NEON
template <>
struct ByteVector<Instructions::neon> {
  using Register = uint64x2_t;
  static uint8x16_t bytes(Register a) { return vreinterpretq_u8_u64(a); }
  static Register load(const void* from) {
    return vreinterpretq_u64_u8(vld1q_u8(static_cast<const uint8_t*>(from)));
  }
  static Register broadcast(uint64_t number) { return vdupq_n_u64(number); }
  static Register sad(Register a, Register b) {
    return vpaddlq_u32(vpaddlq_u16(vpaddlq_u8(vabdq_u8(bytes(a), bytes(b)))));
  }
  static Register add_sad(Register sums, Register a, Register b) {
    return vreinterpretq_u64_u32(
        vpadalq_u16(vreinterpretq_u32_u64(sums), vpaddlq_u8(vabdq_u8(bytes(a), bytes(b)))));
  }
  static uint64_t total(Register sums) { return vaddvq_u32(vreinterpretq_u32_u64(sums)); }
  static Register product(Register a, Register b) { return vmull_u32(vmovn_u64(a), vmovn_u64(b)); }
  static void narrow(const Register* sums, EightInts& eight) {
    const uint32x4_t low = vcombine_u32(vmovn_u64(sums[0]), vmovn_u64(sums[1]));
    const uint32x4_t high = vcombine_u32(vmovn_u64(sums[2]), vmovn_u64(sums[3]));
    __builtin_memcpy(&eight, &low, sizeof low);
    __builtin_memcpy(reinterpret_cast<uint8_t*>(&eight) + sizeof low, &high, sizeof high);
  }
  static Register add_products(Register sums, Register a, Register weights) {
    // Adds pairs of products, and then pairs of these sums.
    const uint8x16_t w = bytes(weights);
    const uint32x4_t low = vpaddlq_u16(vmull_u8(vget_low_u8(bytes(a)), vget_low_u8(w)));
    const uint32x4_t high = vpaddlq_u16(vmull_high_u8(bytes(a), w));
    return vreinterpretq_u64_u32(vaddq_u32(vreinterpretq_u32_u64(sums), vpaddq_u32(low, high)));
  }
  static Register lookup(const uint8_t* table, Register codes) {
    return vreinterpretq_u64_u8(
        vqtbl1q_u8(vld1q_u8(table), vandq_u8(bytes(codes), vdupq_n_u8(15))));
  }
  static Register lookup_upper(const uint8_t* table, Register codes) {
    return vreinterpretq_u64_u8(vqtbl1q_u8(vld1q_u8(table), vshrq_n_u8(bytes(codes), 4)));
  }
  static Register add_saturated(Register a, Register b) {
    return vreinterpretq_u64_u8(vqaddq_u8(bytes(a), bytes(b)));
  }
  static uint64_t at_most(Register a, uint8_t limit) {
    const uint8x16_t bit = {1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128};
    const uint8x16_t low = vandq_u8(vcleq_u8(bytes(a), vdupq_n_u8(limit)), bit);
    return vaddv_u8(vget_low_u8(low)) | static_cast<uint64_t>(vaddv_u8(vget_high_u8(low))) << 8U;
  }
  static constexpr int halved = 8;
  static void halve(const uint8_t* upper, const uint8_t* lower, uint8_t* to) {
    vst1_u8(to, vrshrn_n_u16(vpadalq_u8(vpaddlq_u8(vld1q_u8(upper)), vld1q_u8(lower)), 2));
  }
  static size_t collect(const uint32_t* values, uint32_t limit, uint32_t first, uint32_t* to) {
    const uint32x4_t low = vcleq_u32(vld1q_u32(values), vdupq_n_u32(limit));
    const uint32x4_t bit = {1, 2, 4, 8};
    return write_set_bit_positions(vaddvq_u32(vandq_u32(low, bit)), first, to);
  }
};
#endif

#ifdef __wasm_simd128__
template <>
struct ByteVector<Instructions::simd128> {
  typedef uint64_t Register __attribute__((vector_size(16)));
  static Register to_register(v128_t a) { return reinterpret_cast<Register>(a); }
  static v128_t bits(Register a) { return reinterpret_cast<v128_t>(a); }
  static Register load(const void* from) { return to_register(wasm_v128_load(from)); }
  static Register broadcast(uint64_t number) { return Register{number, number}; }
  static v128_t absolute_differences(v128_t a, v128_t b) {
    return wasm_v128_or(wasm_u8x16_sub_sat(a, b), wasm_u8x16_sub_sat(b, a));
  }
  static v128_t sums_of_four(Register a, Register b) {
    return wasm_u32x4_extadd_pairwise_u16x8(
        wasm_u16x8_extadd_pairwise_u8x16(absolute_differences(bits(a), bits(b))));
  }
  static Register sad(Register a, Register b) {
    const Register sums = to_register(sums_of_four(a, b));
    return (sums & 0xFFFFFFFFU) + (sums >> 32);
  }
  static Register add_sad(Register sums, Register a, Register b) {
    return to_register(wasm_i32x4_add(bits(sums), sums_of_four(a, b)));
  }
  static uint64_t total(Register sums) {
    const Register halves = (sums & 0xFFFFFFFFU) + (sums >> 32);
    return halves[0] + halves[1];
  }
  static Register product(Register a, Register b) {
    const auto even = [](Register x) { return wasm_i32x4_shuffle(bits(x), bits(x), 0, 2, 0, 2); };
    return to_register(wasm_u64x2_extmul_low_u32x4(even(a), even(b)));
  }
  static Register smaller(Register a, Register b) {
    return to_register(wasm_u32x4_min(bits(a), bits(b)));
  }
  static void narrow(const Register* sums, EightInts& eight) {
    const v128_t low = wasm_i32x4_shuffle(bits(sums[0]), bits(sums[1]), 0, 2, 4, 6);
    const v128_t high = wasm_i32x4_shuffle(bits(sums[2]), bits(sums[3]), 0, 2, 4, 6);
    __builtin_memcpy(&eight, &low, sizeof low);
    __builtin_memcpy(reinterpret_cast<uint8_t*>(&eight) + sizeof low, &high, sizeof high);
  }
  static Register add_products(Register sums, Register a, Register weights) {
    // Even and odd bytes as numbers of 16 bits, of which one instruction adds two products.
    const auto even = [](Register x) { return wasm_v128_and(bits(x), wasm_i16x8_splat(255)); };
    const auto odd = [](Register x) { return wasm_u16x8_shr(bits(x), 8); };
    return to_register(
        wasm_i32x4_add(wasm_i32x4_add(bits(sums), wasm_i32x4_dot_i16x8(even(a), even(weights))),
                       wasm_i32x4_dot_i16x8(odd(a), odd(weights))));
  }
  static Register lookup(const uint8_t* table, Register codes) {
    return to_register(wasm_i8x16_swizzle(wasm_v128_load(table),
                                          wasm_v128_and(bits(codes), wasm_i8x16_splat(15))));
  }
  static Register lookup_upper(const uint8_t* table, Register codes) {
    return lookup(table, to_register(wasm_u16x8_shr(bits(codes), 4)));
  }
  static Register add_saturated(Register a, Register b) {
    return to_register(wasm_u8x16_add_sat(bits(a), bits(b)));
  }
  static uint64_t at_most(Register a, uint8_t limit) {
    return wasm_i8x16_bitmask(wasm_u8x16_le(bits(a), wasm_u8x16_splat(limit)));
  }
  static constexpr int halved = 8;
  static void halve(const uint8_t* upper, const uint8_t* lower, uint8_t* to) {
    const auto pairs = [](const uint8_t* from) {
      return wasm_u16x8_extadd_pairwise_u8x16(wasm_v128_load(from));
    };
    const v128_t sums =
        wasm_i16x8_add(wasm_i16x8_add(pairs(upper), pairs(lower)), wasm_i16x8_splat(2));
    const v128_t means = wasm_u16x8_shr(sums, 2);
    wasm_v128_store64_lane(to, wasm_u8x16_narrow_i16x8(means, means), 0);
  }
  static size_t collect(const uint32_t* values, uint32_t limit, uint32_t first, uint32_t* to) {
    const v128_t low = wasm_u32x4_le(wasm_v128_load(values), wasm_u32x4_splat(limit));
    return write_set_bit_positions(static_cast<unsigned>(wasm_i32x4_bitmask(low)), first, to);
  }
};
#endif

}  // namespace
}  // namespace panonav::kernels
