#include "panonav/kernels/column_match.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::kernels {
namespace {

std::vector<std::uint8_t> random_bytes(std::size_t count, Random& random) {
  std::vector<std::uint8_t> bytes(count);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.index(256));
  return bytes;
}

TEST(MatchColumns, AgreesWithItsDefinitionOnEveryInstructionSet) {
  Random random(1);
  int checked = 0;
  for (int trial = 0; trial < 20; ++trial) {
    auto query = random_bytes(512, random);
    auto reference = random_bytes(2048, random);
    if (trial == 0) {  // the largest numbers there are
      query.assign(512, 0);
      reference.assign(2048, 255);
    }
    std::vector<std::uint16_t> expected(128);
    for (std::size_t s = 0; s < 128; ++s) {
      for (std::size_t c = 0; c < 32; ++c) {
        int l1 = 0;
        for (std::size_t b = 0; b < 16; ++b) {
          l1 += std::abs(query[c * 16 + b] - reference[b * 128 + (4 * c + s) % 128]);
        }
        expected[s] = static_cast<std::uint16_t>(expected[s] + std::lround(16.0 * std::sqrt(l1)));
      }
    }
    for (const Instructions set : available_instructions()) {
      std::vector<std::uint16_t> costs(128);
      EXPECT_EQ(match_columns(query, reference, costs, set),
                std::ranges::min_element(expected) - expected.begin())
          << name(set);
      EXPECT_EQ(costs, expected) << name(set);
      ++checked;
    }
  }
  EXPECT_GE(checked, 20);
}

TEST(MatchColumns, RoundsEveryRootAsItsDefinition) {
  const std::vector<std::uint8_t> query(512, 0);
  for (int l1 = 0; l1 <= 16 * 255; ++l1) {
    std::vector<std::uint8_t> reference(2048);
    for (int b = 0, left = l1; b < 16; ++b) {
      const int value = std::min(left, 255);
      std::fill_n(reference.begin() + 128 * b, 128, static_cast<std::uint8_t>(value));
      left -= value;
    }
    const auto expected = static_cast<std::uint16_t>(32 * std::lround(16.0 * std::sqrt(l1)));
    for (const Instructions set : available_instructions()) {
      std::vector<std::uint16_t> costs(128);
      EXPECT_EQ(match_columns(query, reference, costs, set), 0);
      ASSERT_EQ(costs, std::vector<std::uint16_t>(128, expected)) << name(set) << ", L1 " << l1;
    }
  }
}

TEST(ColumnSumsNearTurn, AgreeWithTheirDefinitionOnEveryInstructionSet) {
  Random random(2);
  int checked = 0;
  for (const int turn : {0, 1, 2, 63, 126, 127}) {
    auto query = random_bytes(2048, random);
    auto reference = random_bytes(2048, random);
    if (turn == 0) {  // the largest numbers there are
      query.assign(2048, 0);
      reference.assign(2048, 255);
    }
    std::vector<std::uint16_t> expected(32, 65535);
    for (std::size_t c = 0; c < 32; ++c) {
      for (int s = turn + 127; s <= turn + 129; ++s) {
        int l1 = 0;
        for (std::size_t b = 0; b < 16; ++b) {
          const std::size_t at = (4 * c + static_cast<std::size_t>(s)) % 128;
          l1 += std::abs(query[b * 128 + 4 * c] - reference[b * 128 + at]);
        }
        expected[c] = std::min(expected[c], static_cast<std::uint16_t>(l1));
      }
    }
    for (const Instructions set : available_instructions()) {
      std::vector<std::uint16_t> sums(32);
      column_sums_near_turn(query, reference, turn, sums, set);
      EXPECT_EQ(sums, expected) << name(set) << ", turn " << turn;
      ++checked;
    }
  }
  EXPECT_GE(checked, 6);
}

TEST(ColumnSumsNearTurn, RefusesOtherSizesAndTurns) {
  const std::vector<std::uint8_t> bytes(2048), fewer(2047);
  std::vector<std::uint16_t> sums(32), fewer_sums(31);
  const Instructions set = Instructions::scalar;
  EXPECT_THROW(column_sums_near_turn(fewer, bytes, 0, sums, set), ContractError);
  EXPECT_THROW(column_sums_near_turn(bytes, fewer, 0, sums, set), ContractError);
  EXPECT_THROW(column_sums_near_turn(bytes, bytes, 0, fewer_sums, set), ContractError);
  EXPECT_THROW(column_sums_near_turn(bytes, bytes, 128, sums, set), ContractError);
}

TEST(MatchColumns, RefusesOtherSizes) {
  const std::vector<std::uint8_t> query(512), reference(2048), shorter(511);
  std::vector<std::uint16_t> costs(128), fewer(127);
  EXPECT_THROW(match_columns(shorter, reference, costs, Instructions::scalar), ContractError);
  EXPECT_THROW(match_columns(query, query, costs, Instructions::scalar), ContractError);
  EXPECT_THROW(match_columns(query, reference, fewer, Instructions::scalar), ContractError);
}

}  // namespace
}  // namespace panonav::kernels
