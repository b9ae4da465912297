#include "lab/baselines/rotation_products.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::lab {
using namespace testing;
namespace {

TEST(TurnProducts, EveryInstructionSetAgreesWithTheSumsInDoublePrecision) {
  Random random(3);
  std::size_t compared = 0;
  for (const std::size_t columns : {1U, 5U, 16U, 72U, 90U, 360U}) {
    for (const std::size_t count : {0U, 1U, 4U, 7U}) {
      const std::size_t stride = rotation_products_stride(columns);
      std::vector<float> rows(count * columns);
      for (float& v : rows) v = static_cast<float>(random.uniform(-0.5, 0.5));
      std::vector<float> periodic(columns + stride);
      for (std::size_t i = 0; i < columns; ++i) {
        periodic[i] = static_cast<float>(random.uniform(-0.5, 0.5));
      }
      for (std::size_t i = columns; i < periodic.size(); ++i) periodic[i] = periodic[i - columns];
      for (const kernels::Instructions instructions : kernels::available_instructions()) {
        std::vector<float> products(count * stride, -100.0F);
        std::vector<float> largest(count, -100.0F);
        compute_rotation_products(rows, columns, periodic, products, largest, instructions);
        for (std::size_t r = 0; r < count; ++r) {
          for (std::size_t t = 0; t < stride; ++t) {
            double sum = 0.0;
            for (std::size_t i = 0; i < columns; ++i) {
              sum += static_cast<double>(rows[r * columns + i]) *
                     static_cast<double>(periodic[(t + i) % columns]);
            }
            ASSERT_NEAR(products[r * stride + t], sum, 1e-5) << kernels::name(instructions);
            ++compared;
          }
          const auto row = products.begin() + static_cast<std::ptrdiff_t>(r * stride);
          EXPECT_EQ(largest[r], *std::max_element(row, row + static_cast<std::ptrdiff_t>(stride)));
          // Turns beyond the last repeat the first ones to the bit.
          EXPECT_NE(std::find(row, row + static_cast<std::ptrdiff_t>(columns), largest[r]),
                    row + static_cast<std::ptrdiff_t>(columns));
        }
      }
    }
  }
  EXPECT_GT(compared, 5000U);
}

TEST(TurnProducts, RefusesWrongSizes) {
  std::vector<float> rows(8);
  std::vector<float> periodic(24);
  std::vector<float> products(16);
  std::vector<float> largest(1);
  const auto run = [&](std::size_t columns) {
    compute_rotation_products(rows, columns, periodic, products, largest,
                              kernels::Instructions::scalar);
  };
  EXPECT_NO_THROW(run(8));
  EXPECT_THROW(run(7), ContractError);
  EXPECT_THROW(run(0), ContractError);
  periodic.pop_back();
  EXPECT_THROW(run(8), ContractError);
}

}  // namespace
}  // namespace panonav::lab
