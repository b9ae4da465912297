#include "panonav/kernels/internal/vector.hpp"

namespace panonav::kernels {
namespace {

// `row_count` rows at `vectors * lanes` turns: all sums stay in registers, and each value that is
// loaded is used for all rows or all turns.
template <int lanes, int row_count, int vectors>
inline void products_of_block(const float* rows, int columns, const float* periodic,
                              float* products, int stride,
                              typename Vectors<lanes>::UnalignedFloats* most) {
  using Vector = typename Vectors<lanes>::UnalignedFloats;
  Vector sums[row_count][vectors] = {};
  for (int i = 0; i < columns; ++i) {
    Vector turned[vectors];
    for (int v = 0; v < vectors; ++v) {
      turned[v] = *reinterpret_cast<const Vector*>(periodic + i + v * lanes);
    }
    for (int r = 0; r < row_count; ++r) {
      const float value = rows[r * columns + i];
      for (int v = 0; v < vectors; ++v) sums[r][v] += value * turned[v];
    }
  }
  for (int r = 0; r < row_count; ++r) {
    for (int v = 0; v < vectors; ++v) {
      *reinterpret_cast<Vector*>(products + r * stride + v * lanes) = sums[r][v];
      most[r] = sums[r][v] > most[r] ? sums[r][v] : most[r];
    }
  }
}

template <int lanes, int row_count, int vectors>
inline void products_of_rows(const float* rows, int columns, int stride, const float* periodic,
                             float* products, float* largest) {
  using Vector = typename Vectors<lanes>::UnalignedFloats;
  Vector most[row_count];
  for (int r = 0; r < row_count; ++r) most[r] = Vector{} - 3.4e38F;
  int t = 0;
  for (; t + vectors * lanes <= stride; t += vectors * lanes) {
    products_of_block<lanes, row_count, vectors>(rows, columns, periodic + t, products + t, stride,
                                                 most);
  }
  for (; t < stride; t += lanes) {
    products_of_block<lanes, row_count, 1>(rows, columns, periodic + t, products + t, stride, most);
  }
  for (int r = 0; r < row_count; ++r) {
    float value = most[r][0];
    for (int i = 1; i < lanes; ++i) value = most[r][i] > value ? most[r][i] : value;
    largest[r] = value;
  }
}

}  // namespace

template <Instructions set>
void TurnProductsBody<set>::turn_products(const float* rows, int count, int columns,
                                          const float* periodic, float* products, float* largest) {
  constexpr int lanes = lanes_of<set>;
  // As many as leave registers for the rows.
  constexpr int vectors = set == Instructions::avx512 ? 5 : set == Instructions::neon ? 4 : 2;
  const int stride =
      (columns + turn_products_lanes - 1) / turn_products_lanes * turn_products_lanes;
  constexpr int row_count = 4;
  int r = 0;
  for (; r + row_count <= count; r += row_count) {
    products_of_rows<lanes, row_count, vectors>(rows + r * columns, columns, stride, periodic,
                                                products + r * stride, largest + r);
  }
  for (; r < count; ++r) {
    products_of_rows<lanes, 1, vectors>(rows + r * columns, columns, stride, periodic,
                                        products + r * stride, largest + r);
  }
}

template struct TurnProductsBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
