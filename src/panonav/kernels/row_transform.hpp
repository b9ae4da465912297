#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Computes the first Fourier components of rows of equal length:
///   real(k) + j imaginary(k) = 2 / columns * sum_c value[c] exp(-j 2 pi k c / columns),  k = 0 ..
///   components - 1.
/// Columns c, columns - c and columns / 2 -+ c have equal sines and cosines but for the
/// sign, so each row is first folded to a quarter of its length (with an odd number of columns to a
/// half). The sums of components are then computed in the lanes of a vector. Cost: rows * (columns
/// + components * columns / 2) additions, and components * columns / 2 multiplications. Rounding:
/// some 1e-7 times the mean absolute value of the row.
class RowTransform {
 public:
  /// Throws ContractError unless columns >= 4 and 1 <= components <= columns / 2.
  RowTransform(int columns, int components);

  [[nodiscard]] int columns() const noexcept { return columns_; }  ///< Values of a row.
  /// Number of frequencies k = 0 .. components - 1 that are computed for each row.
  [[nodiscard]] int components() const noexcept { return components_; }

  /// Transforms all rows of `values`, which are stored consecutively. Component k of row y is
  /// written to index k * stride + y of `real` and `imaginary`. Throws ContractError if a span has
  /// the wrong size.
  void operator()(std::span<const float> values, std::span<float> real, std::span<float> imaginary,
                  std::size_t stride, Instructions instructions) const;

 private:
  int columns_, components_;
  int folded_columns_;          // columns that are left after folding
  std::vector<float> cosines_;  // [block of 16 components][folded column][component in the block]
  std::vector<float> sines_;    // the same, with the sign of the imaginary part
};

}  // namespace panonav::kernels
