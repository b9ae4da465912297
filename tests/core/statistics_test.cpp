#include "panonav/core/statistics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

TEST(Quantile, InterpolatesBetweenOrderStatistics) {
  const std::vector<double> values{4.0, 1.0, 3.0, 2.0};
  EXPECT_DOUBLE_EQ(median(values), 2.5);
  EXPECT_DOUBLE_EQ(quantile(values, 0.0), 1.0);
  EXPECT_DOUBLE_EQ(quantile(values, 1.0), 4.0);
  EXPECT_DOUBLE_EQ(quantile(values, 1.0 / 3.0), 2.0);
  EXPECT_THROW((void)quantile({}, 0.5), ContractError);
  EXPECT_THROW((void)quantile(values, 1.5), ContractError);
}

TEST(OrderStatistic, IsOneOfTheValuesAndBelowTheQuantile) {
  EXPECT_DOUBLE_EQ(order_statistic({4.0, 1.0, 3.0, 2.0}, 0.5), 2.0);
  EXPECT_DOUBLE_EQ(upper_median(std::vector{4.0, 1.0, 3.0, 2.0}), 3.0);
  EXPECT_DOUBLE_EQ(order_statistic({4.0, 1.0, 3.0, 2.0}, 1.0), 4.0);
  EXPECT_THROW((void)order_statistic({}, 0.5), ContractError);
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<double> values(1 + random.index(20));
    for (double& value : values) value = random.normal();
    const double fraction = random.uniform(0.0, 1.0);
    const double found = order_statistic(values, fraction);
    EXPECT_NE(std::ranges::find(values, found), values.end());
    EXPECT_LE(found, quantile(values, fraction) + 1e-12);
    if (values.size() % 2 == 1) {
      EXPECT_EQ(order_statistic(values, 0.5), upper_median(values));
    }
  }
}

TEST(Statistics, WeightsOfAGaussianAreSymmetricAndSumToOne) {
  for (const double deviation : {0.3, 1.0, 2.7}) {
    const std::vector<float> weights = gaussian_weights(deviation);
    const std::size_t reach = weights.size() / 2;
    EXPECT_EQ(weights.size(), 2 * reach + 1);
    EXPECT_GE(static_cast<double>(reach), 2.5 * deviation);
    double sum = 0.0;
    double squares = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      EXPECT_EQ(weights[i], weights[weights.size() - 1 - i]);
      const double off = static_cast<double>(i) - static_cast<double>(reach);
      sum += weights[i];
      squares += weights[i] * off * off;
    }
    EXPECT_NEAR(sum, 1.0, 1e-6);
    EXPECT_LT(squares, 1.01 * deviation * deviation) << "the ends are cut off";
  }
  EXPECT_THROW((void)gaussian_weights(0.0), ContractError);
}

}  // namespace
}  // namespace panonav
