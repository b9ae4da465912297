#include "panonav/kernels/column_match.hpp"

#include <gtest/gtest.h>

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
      match_columns(query, reference, costs, set);
      EXPECT_EQ(costs, expected) << name(set);
      ++checked;
    }
  }
  EXPECT_GE(checked, 20);
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
