#include "panonav/kernels/row_transform.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::kernels {
namespace {

// By the definition, in double precision: no table, no folding.
std::complex<double> brute_force(std::span<const float> row, int k) {
  std::complex<double> sum;
  const auto columns = static_cast<double>(row.size());
  for (std::size_t c = 0; c < row.size(); ++c) {
    sum += static_cast<double>(row[c]) *
           std::polar(1.0, -2.0 * std::numbers::pi * k * static_cast<double>(c) / columns);
  }
  return 2.0 / columns * sum;
}

struct Case {
  int rows, columns, components;
};

// Even, odd, twice an odd number, powers of two; one row and rows that do not fill a block of four;
// components that fill one lane, a block of 16, and more.
const Case cases[] = {{1, 4, 2},    {3, 5, 2},     {7, 90, 15},   {25, 120, 15},  {5, 121, 60},
                      {4, 126, 16}, {80, 512, 15}, {2, 512, 256}, {81, 1024, 17}, {6, 37, 1},
                      {9, 34, 17},  {3, 68, 34},   {2, 70, 35},   {5, 1023, 33}};

TEST(RowTransform, AgreesWithTheDefinitionOnEveryInstructionSet) {
  int checked = 0;
  for (const Case& c : cases) {
    Random random(static_cast<std::uint64_t>(c.columns));
    std::vector<float> values(static_cast<std::size_t>(c.rows) * c.columns);
    for (float& value : values) value = static_cast<float>(random.uniform());
    const RowTransform transform(c.columns, c.components);
    // Rows of the result lie further apart than needed, so that writing between them is noticed.
    const std::size_t stride = static_cast<std::size_t>(c.rows) + 3;
    for (const Instructions set : available_instructions()) {
      SCOPED_TRACE(std::string(name(set)) + " " + std::to_string(c.rows) + " x " +
                   std::to_string(c.columns) + " x " + std::to_string(c.components));
      std::vector<float> real(stride * c.components, -9.0F);
      std::vector<float> imaginary = real;
      transform(values, real, imaginary, stride, set);
      for (int k = 0; k < c.components; ++k) {
        for (std::size_t y = 0; y < stride; ++y) {
          const float re = real[k * stride + y];
          const float im = imaginary[k * stride + y];
          if (y >= static_cast<std::size_t>(c.rows)) {
            ASSERT_EQ(re, -9.0F);
            ASSERT_EQ(im, -9.0F);
            continue;
          }
          const auto expected = brute_force(std::span(values).subspan(y * c.columns, c.columns), k);
          ASSERT_NEAR(re, expected.real(), 2e-6) << "k " << k << ", row " << y;
          ASSERT_NEAR(im, expected.imag(), 2e-6) << "k " << k << ", row " << y;
          ++checked;
        }
      }
    }
  }
  EXPECT_GT(checked, 5000);
}

TEST(RowTransform, IsLinearInItsRowsAndKeepsThemApart) {
  // A row full of a pure cosine gives one component, whatever stands in the rows beside it.
  const int columns = 64;
  std::vector<float> values(static_cast<std::size_t>(9) * columns);
  for (int y = 0; y < 9; ++y) {
    for (int c = 0; c < columns; ++c) {
      values[y * columns + c] =
          static_cast<float>(y * std::cos(2.0 * std::numbers::pi * (y + 1) * c / columns + 0.3));
    }
  }
  for (const Instructions set : available_instructions()) {
    std::vector<float> real(9 * 20), imaginary(9 * 20);
    RowTransform(columns, 20)(values, real, imaginary, 9, set);
    for (int y = 0; y < 9; ++y) {
      for (int k = 0; k < 20; ++k) {
        EXPECT_NEAR(real[k * 9 + y], k == y + 1 ? y * std::cos(0.3) : 0.0, 2e-5);
        EXPECT_NEAR(imaginary[k * 9 + y], k == y + 1 ? y * std::sin(0.3) : 0.0, 2e-5);
      }
    }
  }
}

TEST(RowTransform, RefusesWrongSizes) {
  EXPECT_THROW(RowTransform(3, 1), ContractError);
  EXPECT_THROW(RowTransform(8, 0), ContractError);
  EXPECT_THROW(RowTransform(8, 5), ContractError);
  EXPECT_NO_THROW(RowTransform(8, 4));
  const RowTransform transform(8, 4);
  std::vector<float> values(16), result(8), small(7);
  EXPECT_NO_THROW(transform(values, result, result, 2, Instructions::scalar));
  EXPECT_THROW(transform(values, small, result, 2, Instructions::scalar), ContractError);
  EXPECT_THROW(transform(values, result, small, 2, Instructions::scalar), ContractError);
  EXPECT_THROW(transform(values, result, result, 1, Instructions::scalar), ContractError);
  EXPECT_THROW(transform(std::span(values).first(15), result, result, 2, Instructions::scalar),
               ContractError);
}

}  // namespace
}  // namespace panonav::kernels
