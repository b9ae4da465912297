#include "panonav/kernels/remap.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::kernels {
namespace {

std::vector<std::uint8_t> random_bytes(Random& random, std::size_t count) {
  std::vector<std::uint8_t> bytes(count);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.index(256));
  return bytes;
}

TEST(Halve, IsTheRoundedMeanOfFourOnEveryInstructionSet) {
  Random random(1);
  int checked = 0;
  for (const int width : {1, 2, 3, 31, 32, 63, 64, 65, 130, 131, 640}) {
    for (const int height : {1, 2, 5, 6}) {
      const int stride = width + 5;
      const auto bytes = random_bytes(random, static_cast<std::size_t>(stride) * height);
      for (const Instructions set : available_instructions()) {
        // One byte more than promised, to notice writing beyond the end.
        std::vector<std::uint8_t> halved(static_cast<std::size_t>(width / 2) * (height / 2) + 1,
                                         77);
        halve({bytes.data(), width, height, 1, stride}, halved.data(), set);
        EXPECT_EQ(halved.back(), 77);
        for (int v = 0; v < height / 2; ++v) {
          for (int u = 0; u < width / 2; ++u) {
            const std::uint8_t* const at = bytes.data() + 2 * v * stride + 2 * u;
            const double mean = (at[0] + at[1] + at[stride] + at[stride + 1]) / 4.0;
            ASSERT_EQ(halved[v * (width / 2) + u], static_cast<int>(mean + 0.5))
                << name(set) << " " << width;
            ++checked;
          }
        }
      }
    }
  }
  EXPECT_GT(checked, 2000);
}

TEST(PairRows, PutsEachPixelBesideTheOneBelow) {
  Random random(2);
  int checked = 0;
  for (const int width : {1, 15, 16, 17, 32, 33, 100, 640}) {
    for (const int height : {2, 5}) {
      const int stride = width + 3;
      const auto bytes = random_bytes(random, static_cast<std::size_t>(stride) * height);
      for (const Instructions set : available_instructions()) {
        std::vector<std::uint16_t> pairs(static_cast<std::size_t>(width) * (height - 1) + 1, 7);
        pair_rows({bytes.data(), width, height, 1, stride}, pairs.data(), set);
        EXPECT_EQ(pairs.back(), 7);
        for (int v = 0; v < height - 1; ++v) {
          for (int u = 0; u < width; ++u) {
            ASSERT_EQ(pairs[v * width + u],
                      bytes[v * stride + u] + 256 * bytes[(v + 1) * stride + u]);
            ++checked;
          }
        }
      }
    }
  }
  EXPECT_GT(checked, 2000);
}

TEST(Remap, IsTheWeightedSumOfFourPixelsToTheLastBit) {
  Random random(3);
  int checked = 0;
  for (const int count : {1, 7, 16, 63, 64, 65, 90, 128, 200, 512}) {
    for (const int taps : {1, 2, 5}) {
      std::vector<std::uint16_t> pairs(3000);
      for (auto& pair : pairs) pair = static_cast<std::uint16_t>(random.index(65536));
      // All white under the largest weights must not overflow.
      if (count == 128) pairs.assign(pairs.size(), 0xffff);
      std::vector<std::uint32_t> positions(static_cast<std::size_t>(taps) * count);
      std::vector<std::uint32_t> weights(positions.size());
      for (auto& position : positions)
        position = static_cast<std::uint32_t>(random.index(pairs.size() - 1));
      for (auto& weight : weights) {
        std::uint32_t left = tap_weight_sum;
        for (int byte = 0; byte < 3; ++byte) {
          const auto part = static_cast<std::uint32_t>(random.index(left + 1));
          weight |= part << (8 * byte);
          left -= part;
        }
        weight |= left << 24;
      }
      const float scale = 1.0F / static_cast<float>(255 * tap_weight_sum * taps);
      for (const Instructions set : available_instructions()) {
        std::vector<float> values(static_cast<std::size_t>(count) + 1, -1.0F);
        remap(pairs, positions, weights, taps, scale,
              std::span(values).first(static_cast<std::size_t>(count)), set);
        EXPECT_EQ(values.back(), -1.0F);
        for (int i = 0; i < count; ++i) {
          int sum = 0;
          for (int t = 0; t < taps; ++t) {
            const std::size_t entry = static_cast<std::size_t>(t) * count + i;
            for (int byte = 0; byte < 4; ++byte) {
              const std::uint16_t pair = pairs[positions[entry] + byte / 2];
              sum += static_cast<int>((weights[entry] >> (8 * byte)) & 255U) *
                     (byte % 2 == 0 ? pair & 255 : pair >> 8);
            }
          }
          ASSERT_EQ(values[i], scale * static_cast<float>(sum))
              << name(set) << " " << count << " " << taps;
          ++checked;
        }
      }
    }
  }
  EXPECT_GT(checked, 3000);
}

TEST(Remap, RefusesTablesOfTheWrongSize) {
  const std::vector<std::uint16_t> pairs(10);
  const std::vector<std::uint32_t> four(4), three(3);
  std::vector<float> values(2);
  EXPECT_NO_THROW(remap(pairs, four, four, 2, 1.0F, values, Instructions::scalar));
  EXPECT_THROW(remap(pairs, three, four, 2, 1.0F, values, Instructions::scalar), ContractError);
  EXPECT_THROW(remap(pairs, four, three, 2, 1.0F, values, Instructions::scalar), ContractError);
  EXPECT_THROW(remap(pairs, four, four, 0, 1.0F, values, Instructions::scalar), ContractError);
}

}  // namespace
}  // namespace panonav::kernels
