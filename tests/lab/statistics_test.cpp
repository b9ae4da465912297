#include "lab/statistics.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::lab {
using namespace testing;
namespace {

TEST(SuccessRate, WilsonIntervalOfPublishedExample) {
  // 10 of 20: Wilson gives 0.299 .. 0.701.
  const Proportion half = success_rate(10, 20);
  EXPECT_DOUBLE_EQ(half.value, 0.5);
  EXPECT_NEAR(half.low, 0.2993, 5e-4);
  EXPECT_NEAR(half.high, 0.7007, 5e-4);
  const Proportion all = success_rate(50, 50);
  EXPECT_LT(all.low, 0.95);
  EXPECT_DOUBLE_EQ(all.high, 1.0);
  for (std::size_t trials = 1; trials <= 400; ++trials) {
    EXPECT_EQ(success_rate(0, trials).low, 0.0) << trials;
    EXPECT_EQ(success_rate(trials, trials).high, 1.0) << trials;
  }
  EXPECT_THROW((void)success_rate(3, 2), ContractError);
}

TEST(MedianInterval, CoversTheTrueMedianAboutAsOftenAsItSays) {
  int covered = 0;
  constexpr int interval_trials = 300;
  for (std::uint64_t seed = 0; seed < interval_trials; ++seed) {
    Random random(seed);
    std::vector<double> values(41);
    for (auto& value : values) value = random.normal();
    const auto [low, high] = median_interval(values, seed, 300);
    ASSERT_LT(low, high);
    covered += low <= 0.0 && 0.0 <= high ? 1 : 0;
  }
  // 95 % of 300 is 285; four standard deviations of the binomial are 15.
  EXPECT_GE(covered, 270);
  EXPECT_LT(covered, interval_trials);
}

TEST(RankCorrelation, DependsOnOrderAlone) {
  const std::vector<double> a{1.0, 2.0, 3.0, 4.0, 5.0};
  const std::vector<double> grown{1.0, 8.0, 27.0, 64.0, 125.0};
  const std::vector<double> reversed{5.0, 4.0, 3.0, 2.0, 1.0};
  const std::vector<double> constant(5, 2.0);
  EXPECT_NEAR(rank_correlation(a, grown), 1.0, 1e-12);
  EXPECT_NEAR(rank_correlation(a, reversed), -1.0, 1e-12);
  EXPECT_DOUBLE_EQ(rank_correlation(a, constant), 0.0);
}

TEST(Calibration, ComparesStatedWithRightInEachBin) {
  Calibration calibration({0.0, 0.5, 0.9});
  EXPECT_EQ(calibration.error(), 0.0);
  for (int i = 0; i < 10; ++i) calibration.add(0.7, i < 7);  // exactly so
  EXPECT_NEAR(calibration.error(), 0.0, 1e-12);
  for (int i = 0; i < 10; ++i) calibration.add(0.9, i < 4);  // too sure by 0.5
  EXPECT_EQ(calibration.count(), 20U);
  EXPECT_NEAR(calibration.error(), 0.25, 1e-12);
  EXPECT_EQ(calibration.describe(), "stated 0.70: 0.70 right of 10, 0.90: 0.40 right of 10");
  calibration.add(1.0, true);
  EXPECT_THROW(calibration.add(1.1, true), ContractError);
  EXPECT_THROW(Calibration({0.5}), ContractError);
}

}  // namespace
}  // namespace panonav::lab
