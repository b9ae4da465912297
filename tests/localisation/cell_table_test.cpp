#include "panonav/localisation/internal/cell_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

#include "panonav/core/random.hpp"

namespace panonav {
namespace {

TEST(CellTable, NumbersCellsAsAMapDoesInTheOrderOfTheirAdding) {
  Random random(5);
  CellTable table;
  std::map<std::pair<std::int32_t, std::int32_t>, std::uint32_t> numbers;
  for (int i = 0; i < 3000; ++i) {
    const GridCell cell{static_cast<std::int32_t>(random.index(50)) - 25,
                        static_cast<std::int32_t>(random.index(50)) * 1'000'000};
    const auto known = numbers.find({cell.x, cell.y});
    const auto found = table.find(cell);
    ASSERT_EQ(found.has_value(), known != numbers.end());
    if (found) {
      EXPECT_EQ(*found, known->second);
    }
    const auto [entry, added] = numbers.try_emplace({cell.x, cell.y}, table.size());
    ASSERT_EQ(table.find_or_add(cell), entry->second);
    EXPECT_EQ(table[entry->second], cell);
  }
  EXPECT_EQ(table.size(), numbers.size());
  EXPECT_GT(table.size(), 1000U);
}

TEST(CellIndex, IsTheFloorWithinItsLimits) {
  for (const double cells : {-2.0, -1.5, -0.0, 0.0, 0.5, 1.0, 12345.9, -1e9 + 0.5}) {
    EXPECT_EQ(cell_index(cells, 2e9), static_cast<std::int32_t>(std::floor(cells))) << cells;
  }
  EXPECT_EQ(cell_index(1e300, 1e9), 1'000'000'000);
  EXPECT_EQ(cell_index(-1e300, 1e9), -1'000'000'000);
  EXPECT_EQ(cell_index(std::numeric_limits<double>::quiet_NaN(), 1e9), 1'000'000'000);
}

}  // namespace
}  // namespace panonav
