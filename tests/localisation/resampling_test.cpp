#include "panonav/localisation/internal/resampling.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "panonav/core/error.hpp"

namespace panonav {
namespace {

TEST(EffectiveSampleSize, CountsEqualWeightsAndIgnoresScale) {
  EXPECT_DOUBLE_EQ(effective_sample_size(std::vector<double>(7, 0.3)), 7.0);
  EXPECT_DOUBLE_EQ(effective_sample_size(std::vector<double>{0.0, 5.0, 0.0}), 1.0);
  EXPECT_DOUBLE_EQ(effective_sample_size(std::vector<double>{}), 0.0);
  EXPECT_DOUBLE_EQ(effective_sample_size(std::vector<double>{0.0, 0.0}), 0.0);
  const std::vector<double> weights{1.0, 2.0, 3.0};
  EXPECT_NEAR(effective_sample_size(weights), 36.0 / 14.0, 1e-12);
}

TEST(LowVarianceResample, TakesEachAsOftenAsItsShareUpToOne) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<double> weights(1 + random.index(50));
    double sum = 0.0;
    for (double& weight : weights) {
      weight = random.index(4) == 0 ? 0.0 : random.uniform(0.0, 2.0);
      sum += weight;
    }
    if (!(sum > 0.0)) continue;
    const std::size_t count = 1 + random.index(300);
    const auto survivors = resample_systematically(weights, count, random);
    ASSERT_EQ(survivors.size(), count);
    EXPECT_TRUE(std::ranges::is_sorted(survivors));
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const double share = static_cast<double>(count) * weights[i] / sum;
      const auto draws = static_cast<double>(std::ranges::count(survivors, i));
      EXPECT_GE(draws, std::floor(share - 1e-9));
      EXPECT_LE(draws, std::ceil(share + 1e-9));
    }
  }
}

TEST(LowVarianceResample, IsRightOnAverage) {
  const std::vector<double> weights{0.05, 0.6, 0.35};
  std::vector<double> counts(3);
  constexpr int trials = 20000;
  Random random(4);
  for (int trial = 0; trial < trials; ++trial) {
    for (const std::size_t i : resample_systematically(weights, 2, random)) counts[i] += 1.0;
  }
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(counts[i] / (2.0 * trials), weights[i], 0.01);
}

TEST(LowVarianceResample, RefusesWeightsThatAreNone) {
  Random random(5);
  EXPECT_THROW((void)resample_systematically(std::vector<double>{0.0, 0.0}, 3, random),
               ContractError);
  EXPECT_THROW((void)resample_systematically(std::vector<double>{1.0, -0.1}, 3, random),
               ContractError);
  EXPECT_THROW((void)resample_systematically(
                   std::vector<double>{1.0, std::numeric_limits<double>::quiet_NaN()}, 3, random),
               ContractError);
}

// The bound of Fox 2003 holds when 2 n times the divergence of n draws is below the 0.99
// quantile of chi squared with bins - 1 degrees of freedom; checked by drawing.
TEST(KldSampleSize, DrawsOfThatSizeAreWithinTheError) {
  constexpr std::size_t bins = 20;
  constexpr double error = 0.05;
  const std::size_t count = kld_sample_size(bins, error);
  EXPECT_GT(count, bins);
  Random random(6);
  int within = 0;
  constexpr int trials = 2000;
  for (int trial = 0; trial < trials; ++trial) {
    std::vector<double> drawn(bins);
    for (std::size_t i = 0; i < count; ++i) drawn[random.index(bins)] += 1.0;
    double divergence = 0.0;
    for (const double n : drawn) {
      const double share = n / static_cast<double>(count);
      if (share > 0.0) divergence += share * std::log(share * bins);
    }
    within += divergence <= error ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(within) / trials, 0.99, 0.01);
}

TEST(KldSampleSize, GrowsWithBinsAndExactness) {
  EXPECT_EQ(kld_sample_size(0, 0.1), 1U);
  EXPECT_EQ(kld_sample_size(1, 0.1), 1U);
  EXPECT_LT(kld_sample_size(10, 0.1), kld_sample_size(20, 0.1));
  EXPECT_LT(kld_sample_size(10, 0.1), kld_sample_size(10, 0.05));
  EXPECT_THROW((void)kld_sample_size(10, 0.0), ContractError);
}

}  // namespace
}  // namespace panonav
