#include "lab/baselines/rotation_products.hpp"

#include <limits>

#include "panonav/core/error.hpp"

namespace panonav::lab {

namespace {

/// The products of a row are padded to a multiple of this number of turns: the floats of the widest
/// register.
constexpr std::size_t stride_multiple = 16;

template <int lanes>
struct Lanes {
  typedef float Floats __attribute__((vector_size(4 * lanes), aligned(4)));
};

/// Correlates `row_count` rows at `vectors * lanes` turns from turn `t` on. All sums stay in
/// registers; each loaded value is used for all rows or all turns.
template <int lanes, int row_count, int vectors>
[[gnu::always_inline]] inline void correlate_block(const float* rows, std::size_t columns,
                                                   const float* periodic, std::size_t t,
                                                   std::size_t stride, float* products,
                                                   typename Lanes<lanes>::Floats* largest) {
  using Floats = typename Lanes<lanes>::Floats;
  Floats sums[row_count][vectors] = {};
  for (std::size_t i = 0; i < columns; ++i) {
    Floats turned[vectors];
    for (int v = 0; v < vectors; ++v) {
      turned[v] = *reinterpret_cast<const Floats*>(periodic + t + i + v * lanes);
    }
    for (int r = 0; r < row_count; ++r) {
      const float value = rows[static_cast<std::size_t>(r) * columns + i];
      for (int v = 0; v < vectors; ++v) sums[r][v] += value * turned[v];
    }
  }
  for (int r = 0; r < row_count; ++r) {
    for (int v = 0; v < vectors; ++v) {
      float* const to = products + static_cast<std::size_t>(r) * stride + t + v * lanes;
      *reinterpret_cast<Floats*>(to) = sums[r][v];
      largest[r] = sums[r][v] > largest[r] ? sums[r][v] : largest[r];
    }
  }
}

template <int lanes, int row_count, int vectors>
[[gnu::always_inline]] inline void correlate_rows(const float* rows, std::size_t columns,
                                                  const float* periodic, std::size_t stride,
                                                  float* products, float* largest) {
  using Floats = typename Lanes<lanes>::Floats;
  Floats greatest[row_count];
  for (Floats& row : greatest) row = Floats{} - std::numeric_limits<float>::max();
  std::size_t t = 0;
  for (; t + vectors * lanes <= stride; t += vectors * lanes) {
    correlate_block<lanes, row_count, vectors>(rows, columns, periodic, t, stride, products,
                                               greatest);
  }
  for (; t < stride; t += lanes) {
    correlate_block<lanes, row_count, 1>(rows, columns, periodic, t, stride, products, greatest);
  }
  for (int r = 0; r < row_count; ++r) {
    largest[r] = greatest[r][0];
    for (int i = 1; i < lanes; ++i) {
      largest[r] = greatest[r][i] > largest[r] ? greatest[r][i] : largest[r];
    }
  }
}

/// Correlates all rows, four at a time. `vectors` is the largest number of turn registers that
/// still leaves registers for the rows.
template <int lanes, int vectors>
[[gnu::always_inline]] inline void correlate_all(const float* rows, std::size_t count,
                                                 std::size_t columns, const float* periodic,
                                                 float* products, float* largest) {
  const std::size_t stride = rotation_products_stride(columns);
  constexpr int row_count = 4;
  std::size_t r = 0;
  for (; r + row_count <= count; r += row_count) {
    correlate_rows<lanes, row_count, vectors>(rows + r * columns, columns, periodic, stride,
                                              products + r * stride, largest + r);
  }
  for (; r < count; ++r) {
    correlate_rows<lanes, 1, vectors>(rows + r * columns, columns, periodic, stride,
                                      products + r * stride, largest + r);
  }
}

#if defined(__x86_64__)
[[gnu::target("avx512f,avx512bw,avx512dq,avx512vl,fma,prefer-vector-width=512")]] void
correlate_by_avx512(const float* rows, std::size_t count, std::size_t columns,
                    const float* periodic, float* products, float* largest) {
  correlate_all<16, 5>(rows, count, columns, periodic, products, largest);
}
[[gnu::target("avx2,fma")]] void correlate_by_avx2(const float* rows, std::size_t count,
                                                   std::size_t columns, const float* periodic,
                                                   float* products, float* largest) {
  correlate_all<8, 2>(rows, count, columns, periodic, products, largest);
}
#endif

/// Number of registers of four floats, which every processor has, for the turns; ARM has 32
/// registers and x86 16.
#if defined(__aarch64__)
constexpr int vectors_of_four = 4;
#else
constexpr int vectors_of_four = 2;
#endif
void correlate_by_four(const float* rows, std::size_t count, std::size_t columns,
                       const float* periodic, float* products, float* largest) {
  correlate_all<4, vectors_of_four>(rows, count, columns, periodic, products, largest);
}

}  // namespace

std::size_t rotation_products_stride(std::size_t columns) noexcept {
  return (columns + stride_multiple - 1) / stride_multiple * stride_multiple;
}

void compute_rotation_products(std::span<const float> rows, std::size_t columns,
                               std::span<const float> periodic, std::span<float> products,
                               std::span<float> largest, kernels::Instructions instructions) {
  const auto check = [](std::size_t size, std::size_t expected, const char* what) {
    require(size == expected, what, static_cast<double>(size),
            to_text(static_cast<double>(expected)));
  };
  const std::size_t count = largest.size();
  const std::size_t stride = rotation_products_stride(columns);
  require(columns >= 1 && columns <= 65536, "columns", static_cast<double>(columns), "1 .. 65536");
  check(rows.size(), count * columns, "values of the rows");
  check(periodic.size(), columns + stride, "values of the periodic row");
  check(products.size(), count * stride, "products");
  auto* correlate = correlate_by_four;
#if defined(__x86_64__)
  if (instructions == kernels::Instructions::avx512) correlate = correlate_by_avx512;
  if (instructions == kernels::Instructions::avx2) correlate = correlate_by_avx2;
#endif
  correlate(rows.data(), count, columns, periodic.data(), products.data(), largest.data());
}

}  // namespace panonav::lab
