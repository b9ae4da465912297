#include "panonav/kernels/internal/vector.hpp"

namespace panonav::kernels {
namespace {

template <int lanes>
inline typename Vectors<lanes>::Floats load(const float* from) {
  return *reinterpret_cast<const typename Vectors<lanes>::UnalignedFloats*>(from);
}

template <int lanes>
inline void store(float* to, typename Vectors<lanes>::Floats value) {
  *reinterpret_cast<typename Vectors<lanes>::UnalignedFloats*>(to) = value;
}

/// Repeats a pair of floats over all lanes.
template <int lanes>
inline typename Vectors<lanes>::Floats broadcast_pair(const float* pair) {
  int64_t bits;
  __builtin_memcpy(&bits, pair, sizeof bits);
  const typename Vectors<lanes>::Longs repeated = bits - typename Vectors<lanes>::Longs{};
  return reinterpret_cast<typename Vectors<lanes>::Floats>(repeated);
}

template <int lanes>
inline typename Vectors<lanes>::Floats reverse_lanes(typename Vectors<lanes>::Floats v) {
  if constexpr (lanes == 16) {
    return __builtin_shufflevector(v, v, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
  } else if constexpr (lanes == 8) {
    return __builtin_shufflevector(v, v, 7, 6, 5, 4, 3, 2, 1, 0);
  } else {
    return __builtin_shufflevector(v, v, 3, 2, 1, 0);
  }
}

/// a0 b0 a1 b1 ..
template <int lanes>
inline void store_interleaved(float* to, typename Vectors<lanes>::Floats a,
                              typename Vectors<lanes>::Floats b) {
  if constexpr (lanes == 16) {
    store<16>(
        to, __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23));
    store<16>(to + 16, __builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29,
                                               14, 30, 15, 31));
  } else if constexpr (lanes == 8) {
    store<8>(to, __builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11));
    store<8>(to + 8, __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15));
  } else {
    store<4>(to, __builtin_shufflevector(a, b, 0, 4, 1, 5));
    store<4>(to + 4, __builtin_shufflevector(a, b, 2, 6, 3, 7));
  }
}

/// Folds columns c .. c + lanes - 1 of a row with an even number of columns, as fold_column does
/// for column c.
template <int lanes>
inline void fold_columns(const float* row, int columns, int c, float* even, float* odd) {
  const int half = columns / 2;
  const auto a = load<lanes>(row + c);
  const auto b = reverse_lanes<lanes>(load<lanes>(row + columns - c - lanes + 1));
  const auto d = reverse_lanes<lanes>(load<lanes>(row + half - c - lanes + 1));
  const auto f = load<lanes>(row + half + c);
  const auto near_sum = a + b;
  const auto near_difference = a - b;
  const auto far_sum = d + f;
  const auto far_difference = d - f;
  store_interleaved<lanes>(even + 2 * c, near_sum + far_sum, near_sum - far_sum);
  store_interleaved<lanes>(odd + 2 * c, near_difference - far_difference,
                           near_difference + far_difference);
}

/// Folds column c and its three mirror images; results are interleaved: index 2 c for even k, 2 c +
/// 1 for odd k.
inline void fold_column(const float* row, int columns, int c, float* even, float* odd) {
  const int half = columns / 2;
  const float near_sum = row[c] + row[columns - c];
  const float near_difference = row[c] - row[columns - c];
  const float far_sum = row[half - c] + row[half + c];
  const float far_difference = row[half - c] - row[half + c];
  even[2 * c] = near_sum + far_sum;
  even[2 * c + 1] = near_sum - far_sum;
  odd[2 * c] = near_difference - far_difference;
  odd[2 * c + 1] = near_difference + far_difference;
}

template <int lanes>
inline void fold_row(const float* row, int columns, int folded, float* even, float* odd) {
  if (columns % 2 != 0) {
    even[0] = even[1] = row[0];
    odd[0] = odd[1] = 0.0F;
    for (int c = 1; c < folded; ++c) {
      even[2 * c] = even[2 * c + 1] = row[c] + row[columns - c];
      odd[2 * c] = odd[2 * c + 1] = row[c] - row[columns - c];
    }
    return;
  }
  const int half = columns / 2;
  const int end = (half + 1) / 2;  // columns 1 .. end - 1 have three mirror images
  even[0] = row[0] + row[half];
  even[1] = row[0] - row[half];
  odd[0] = odd[1] = 0.0F;
  if (end > lanes) {
    for (int c = 1; c + lanes <= end; c += lanes) fold_columns<lanes>(row, columns, c, even, odd);
    fold_columns<lanes>(row, columns, end - lanes, even, odd);  // overlaps, equal values
  } else {
    for (int c = 1; c < end; ++c) fold_column(row, columns, c, even, odd);
  }
  if (half % 2 == 0) {
    // The column at a quarter turn has only one mirror image: its cosine is 0 for odd k, its sine
    // is 0 for even k.
    const int c = half / 2;
    even[2 * c] = row[c] + row[columns - c];
    even[2 * c + 1] = 0.0F;
    odd[2 * c] = 0.0F;
    odd[2 * c + 1] = row[c] - row[columns - c];
  }
}

/// Folds and transforms `rows` rows at once, so that each table entry is read once for all rows and
/// their independent sums hide latency.
template <int lanes, int rows>
inline void transform_rows(const RowTransformJob& job, int first_row) {
  using Floats = typename Vectors<lanes>::Floats;
  const int length = 2 * job.folded;
  float* const even = job.scratch;
  float* const odd = job.scratch + static_cast<long>(rows) * length;
  for (int r = 0; r < rows; ++r) {
    fold_row<lanes>(job.values + static_cast<long>(first_row + r) * job.columns, job.columns,
                    job.folded, even + static_cast<long>(r) * length,
                    odd + static_cast<long>(r) * length);
  }
  for (int first = 0; first < job.components; first += lanes) {
    const int block = first / row_transform_block;
    const long table =
        static_cast<long>(block) * job.folded * row_transform_block + first % row_transform_block;
    const float* const cosines = job.cosines + table;
    const float* const sines = job.sines + table;
    Floats real[rows] = {};
    Floats imaginary[rows] = {};
    for (int c = 0; c < job.folded; ++c) {
      const Floats cosine = load<lanes>(cosines + static_cast<long>(c) * row_transform_block);
      const Floats sine = load<lanes>(sines + static_cast<long>(c) * row_transform_block);
#pragma GCC unroll 4
      for (int r = 0; r < rows; ++r) {
        real[r] += broadcast_pair<lanes>(even + static_cast<long>(r) * length + 2 * c) * cosine;
        imaginary[r] += broadcast_pair<lanes>(odd + static_cast<long>(r) * length + 2 * c) * sine;
      }
    }
    for (int k = 0; k < lanes && first + k < job.components; ++k) {
      const unsigned long to = static_cast<unsigned long>(first + k) * job.stride + first_row;
      for (int r = 0; r < rows; ++r) {
        job.real[to + r] = real[r][k];
        job.imaginary[to + r] = imaginary[r][k];
      }
    }
  }
}

}  // namespace

template <Instructions set>
void RowTransformBody<set>::row_transform(const RowTransformJob& job) {
  constexpr int lanes = lanes_of<set>;
  int y = 0;
  for (; y + 4 <= job.rows; y += 4) transform_rows<lanes, 4>(job, y);
  for (; y < job.rows; ++y) transform_rows<lanes, 1>(job, y);
}

template struct RowTransformBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
