#include "panonav/kernels/internal/vector.hpp"

namespace panonav::kernels {
namespace {

/// Loads the four pixels of each of `count` taps. Ordinary loads were measured to be faster than
/// the gather instructions of AVX2 and AVX-512; NEON has none.
inline void gather_pairs(const uint16_t* pairs, const uint32_t* positions, int count,
                         uint32_t* pixels) {
#pragma GCC unroll 8
  for (int i = 0; i < count; i += 2) {
    uint64_t two;  // one load for two positions; both machines are little endian
    __builtin_memcpy(&two, positions + i, sizeof two);
    __builtin_memcpy(pixels + i, pairs + static_cast<uint32_t>(two), sizeof *pixels);
    __builtin_memcpy(pixels + i + 1, pairs + (two >> 32U), sizeof *pixels);
  }
}

/// Computes the values i .. i + count - 1.
template <Instructions set, int count>
[[gnu::always_inline]] inline void remap_lanes(const RemapJob& job, int i) {
  using Vector = ByteVector<set>;
  constexpr int lanes = lanes_of<set>;
  alignas(64) uint32_t pixels[count];
  typename Vector::Register sums[count / lanes] = {};
  for (long t = 0; t < job.taps; ++t) {
    const long entry = t * job.count + i;
    gather_pairs(job.pairs, job.positions + entry, count, pixels);
    for (int j = 0; j < count / lanes; ++j) {
      // Bytes are at most 255 and weights add up to at most 127, so sums of two products stay below
      // 2^15.
      sums[j] = Vector::add_products(sums[j], Vector::load(pixels + j * lanes),
                                     Vector::load(job.weights + entry + j * lanes));
    }
  }
  for (int j = 0; j < count / lanes; ++j) {
    using Ints = typename Vectors<lanes>::Ints;
    using Floats = typename Vectors<lanes>::Floats;
    const Floats values =
        job.scale * __builtin_convertvector(reinterpret_cast<Ints>(sums[j]), Floats);
    __builtin_memcpy(job.values + i + j * lanes, &values, sizeof values);
  }
}

}  // namespace

template <Instructions set>
void RemapBody<set>::halve(const uint8_t* __restrict pixels, ptrdiff_t stride, int width,
                           int height, uint8_t* __restrict halved) {
  for (int v = 0; v < height; ++v, pixels += 2 * stride, halved += width) {
    const uint8_t* const lower = pixels + stride;
    int u = 0;
    if constexpr (set != Instructions::scalar) {
      using Vector = ByteVector<set>;
      for (; u + Vector::halved <= width; u += Vector::halved) {
        Vector::halve(pixels + 2 * u, lower + 2 * u, halved + u);
      }
    }
    for (; u < width; ++u) {
      const int sum = pixels[2 * u] + pixels[2 * u + 1] + lower[2 * u] + lower[2 * u + 1];
      halved[u] = static_cast<uint8_t>((sum + 2) >> 2);
    }
  }
}

template <Instructions set>
void RemapBody<set>::pair_rows(const uint8_t* __restrict pixels, ptrdiff_t stride, int width,
                               int height, uint16_t* __restrict pairs) {
  for (int v = 0; v < height; ++v, pixels += stride, pairs += width) {
    const uint8_t* const lower = pixels + stride;
    int u = 0;
    if constexpr (requires { ByteVector<set>::pair(pixels, lower, pairs); }) {
      for (; u + 32 <= width; u += 32) ByteVector<set>::pair(pixels + u, lower + u, pairs + u);
    }
    if constexpr (set == Instructions::scalar) {
      for (; u < width; ++u) pairs[u] = static_cast<uint16_t>(pixels[u] | (lower[u] << 8));
    } else {  // on little endian machines
      auto* const bytes = reinterpret_cast<uint8_t*>(pairs);
      for (; u < width; ++u) {
        bytes[2 * u] = pixels[u];
        bytes[2 * u + 1] = lower[u];
      }
    }
  }
}

template <Instructions set>
void RemapBody<set>::remap(const RemapJob& job) {
  int i = 0;
  if constexpr (set != Instructions::scalar) {
    constexpr int lanes = lanes_of<set>;
    for (; i + 64 <= job.count; i += 64) remap_lanes<set, 64>(job, i);
    for (; i + lanes <= job.count; i += lanes) remap_lanes<set, lanes>(job, i);
  }
  for (; i < job.count; ++i) {
    uint32_t sum = 0;
    for (long t = 0; t < job.taps; ++t) {
      const long entry = t * job.count + i;
      const uint16_t* const at = job.pairs + job.positions[entry];
      const uint32_t weights = job.weights[entry];
      sum += (at[0] & 0xffU) * (weights & 0xffU) + (at[0] >> 8U) * ((weights >> 8U) & 0xffU) +
             (at[1] & 0xffU) * ((weights >> 16U) & 0xffU) + (at[1] >> 8U) * (weights >> 24U);
    }
    job.values[i] = job.scale * static_cast<float>(static_cast<int32_t>(sum));
  }
}

template struct RemapBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
