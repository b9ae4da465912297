#include "panonav/kernels/sketch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::kernels {
namespace {

TEST(EncodeSums, WritesTheNearestCodesOnEveryInstructionSet) {
  Random random(1);
  int checked = 0;
  int outside = 0;
  for (int trial = 0; trial < 50; ++trial) {
    constexpr std::size_t groups = 5;
    constexpr std::size_t stride = 11;
    const int beyond = trial % 2 == 0 ? 0 : 30;  // how far sums may lie outside the scale
    std::vector<std::int32_t> sums, offsets, highest;
    std::vector<std::uint64_t> steps;
    std::vector<float> inverse_steps;
    bool is_within = true;
    for (std::size_t g = 0; g < groups; ++g) {
      steps.push_back(1 + random.index(9));
      inverse_steps.push_back(1.0F / static_cast<float>(steps.back()));
      for (int i = 0; i < 8; ++i) {
        offsets.push_back(static_cast<std::int32_t>(random.index(500)));
        const auto range = static_cast<std::int32_t>(255 * steps.back());
        highest.push_back(offsets.back() + range);
        sums.push_back(offsets.back() - beyond +
                       static_cast<std::int32_t>(
                           random.index(static_cast<std::uint64_t>(range + 2 * beyond + 1))));
        is_within = is_within && sums.back() >= offsets.back() && sums.back() <= highest.back();
      }
    }
    outside += is_within ? 0 : 1;
    const SumScale scale{offsets.data(), highest.data(), steps.data(), inverse_steps.data(),
                         groups};
    for (const Instructions set : available_instructions()) {
      std::vector<std::uint8_t> codes(groups * stride, 7);
      const EncodedSums encoded = encode_sums(sums, scale, codes.data(), stride, set);
      EXPECT_EQ(encoded.is_within, is_within) << name(set);
      int missed = 0;
      for (std::size_t i = 0; i < sums.size(); ++i) {
        const auto step = static_cast<int>(steps[i / 8]);
        const double exact = static_cast<double>(sums[i] - offsets[i]) / step;
        const int code = codes[i / 8 * stride + i % 8];
        EXPECT_NEAR(code, std::clamp(exact, 0.0, 255.0), 0.5001) << name(set);
        missed += std::abs(sums[i] - offsets[i] - step * code);
        ++checked;
      }
      EXPECT_EQ(encoded.missed, missed) << name(set);
      EXPECT_EQ(codes[8], 7) << "between the groups";
    }
  }
  EXPECT_GE(checked, 1000);
  EXPECT_GE(outside, 10);
}

TEST(EncodeSums, RefusesAnotherNumberOfSums) {
  const std::vector<std::int32_t> sums(7);
  std::vector<std::uint8_t> codes(8);
  EXPECT_THROW((void)encode_sums(sums, {nullptr, nullptr, nullptr, nullptr, 1}, codes.data(), 8,
                                 Instructions::scalar),
               ContractError);
}

}  // namespace
}  // namespace panonav::kernels
