#include "panonav/kernels/row_transform.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

RowTransform::RowTransform(int columns, int components)
    : columns_(columns), components_(components) {
  require(columns >= 4, "columns", columns, ">= 4");
  require(components >= 1 && components <= columns / 2, "components", components,
          "1 .. " + std::to_string(columns / 2) + " (half the columns)");
  folded_columns_ = columns % 2 == 0 ? columns / 4 + 1 : (columns + 1) / 2;
  const int blocks = (components + row_transform_block - 1) / row_transform_block;
  const auto size = static_cast<std::size_t>(blocks) * folded_columns_ * row_transform_block;
  cosines_.assign(size, 0.0F);
  sines_.assign(size, 0.0F);

  // Tabulates one full turn, since all angles are multiples of the angle of one column.
  const double scale = 2.0 / columns;
  std::vector<float> cosine(static_cast<std::size_t>(columns));
  std::vector<float> sine(static_cast<std::size_t>(columns));
  for (int c = 0; c <= columns / 2; ++c) {
    const double angle = 2.0 * std::numbers::pi * c / columns;
    const auto mirrored = static_cast<std::size_t>((columns - c) % columns);
    cosine[c] = cosine[mirrored] = static_cast<float>(scale * std::cos(angle));
    sine[c] = static_cast<float>(-scale * std::sin(angle));
    sine[mirrored] = -sine[c];
  }
  for (int k = 0; k < components; ++k) {
    const int block = k / row_transform_block;
    for (int c = 0; c < folded_columns_; ++c) {
      const auto at = static_cast<std::size_t>(static_cast<long>(k) * c % columns);
      const auto to =
          (static_cast<std::size_t>(block) * folded_columns_ + c) * row_transform_block +
          k % row_transform_block;
      cosines_[to] = cosine[at];
      sines_[to] = sine[at];
    }
  }
}

void RowTransform::operator()(std::span<const float> values, std::span<float> real,
                              std::span<float> imaginary, std::size_t stride,
                              Instructions instructions) const {
  const std::size_t rows = values.size() / static_cast<std::size_t>(columns_);
  require(rows * columns_ == values.size(), "number of values", static_cast<double>(values.size()),
          "a multiple of " + std::to_string(columns_) + " (whole rows)");
  if (rows == 0) return;
  require(stride >= rows, "stride", static_cast<double>(stride), ">= rows");
  const std::size_t needed = (static_cast<std::size_t>(components_) - 1) * stride + rows;
  require(real.size() >= needed && imaginary.size() >= needed, "size of the result",
          static_cast<double>(std::min(real.size(), imaginary.size())),
          ">= " + std::to_string(needed));

  std::vector<float> scratch(row_transform_scratch(folded_columns_));
  const RowTransformJob job{values.data(),   static_cast<int>(rows), columns_,      components_,
                            folded_columns_, cosines_.data(),        sines_.data(), scratch.data(),
                            real.data(),     imaginary.data(),       stride};
  with_body<RowTransformBody>(instructions, [&](auto body) { body.row_transform(job); });
}

}  // namespace panonav::kernels
