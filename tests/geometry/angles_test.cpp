#include "panonav/geometry/angles.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/random.hpp"

namespace panonav {
namespace {

TEST(WrapAngle, StaysInsideTheHalfOpenInterval) {
  const std::vector<double> hard = {-1e-17,
                                    1e-17,
                                    0.0,
                                    std::numbers::pi,
                                    -std::numbers::pi,
                                    3.0 * std::numbers::pi,
                                    -3.0 * std::numbers::pi,
                                    1e9,
                                    -1e9,
                                    1e300,
                                    -1e300,
                                    std::nextafter(std::numbers::pi, 0.0),
                                    std::nextafter(std::numbers::pi, 4.0),
                                    std::nextafter(-std::numbers::pi, 0.0),
                                    std::nextafter(-std::numbers::pi, -4.0),
                                    std::numeric_limits<double>::max(),
                                    std::numeric_limits<double>::denorm_min()};
  for (const double angle : hard) {
    const double wrapped = wrap_angle(angle);
    EXPECT_GE(wrapped, -std::numbers::pi) << angle;
    EXPECT_LT(wrapped, std::numbers::pi) << angle;
  }
  EXPECT_EQ(wrap_angle(-1e-17), -1e-17);
  EXPECT_EQ(wrap_angle(std::numbers::pi), -std::numbers::pi);
  EXPECT_EQ(wrap_angle(-std::numbers::pi), -std::numbers::pi);
}

TEST(WrapAngle, IsTheSameAngleAndIdempotent) {
  Random random(11);
  for (int i = 0; i < 10'000; ++i) {
    const double angle = random.uniform(-100.0, 100.0);
    const double wrapped = wrap_angle(angle);
    EXPECT_NEAR(std::cos(wrapped), std::cos(angle), 1e-12);
    EXPECT_NEAR(std::sin(wrapped), std::sin(angle), 1e-12);
    EXPECT_EQ(wrap_angle(wrapped), wrapped);
  }
}

TEST(WrapAngle, AnswersNotANumberWithNotANumber) {
  EXPECT_TRUE(std::isnan(wrap_angle(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_TRUE(std::isnan(wrap_angle(std::numeric_limits<double>::infinity())));
  EXPECT_TRUE(std::isnan(wrap_angle(-std::numeric_limits<double>::infinity())));
}

TEST(AngleDifference, IsTheShortWayRound) {
  EXPECT_NEAR(angle_difference(radians(-170), radians(170)), radians(20), 1e-12);
  EXPECT_NEAR(angle_difference(radians(170), radians(-170)), radians(-20), 1e-12);
  EXPECT_DOUBLE_EQ(degrees(radians(37.5)), 37.5);
}

TEST(CircularMean, OfAnglesAcrossTheCutIsNotTheArithmeticMean) {
  const std::vector<double> angles = {radians(179), radians(-179), radians(178), radians(-178)};
  const auto mean = circular_mean(angles);
  ASSERT_TRUE(mean);
  EXPECT_NEAR(std::abs(mean->direction_rad), std::numbers::pi, 1e-12);
  EXPECT_GT(mean->resultant_length, 0.999);
}

TEST(CircularMean, TurnsWithTheAngles) {
  Random random(12);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<double> angles;
    for (int i = 0; i < 20; ++i) angles.push_back(random.normal(0.3, 0.7));
    const double turn = random.uniform(-std::numbers::pi, std::numbers::pi);
    std::vector<double> turned = angles;
    for (double& a : turned) a += turn;
    const auto before = circular_mean(angles);
    const auto after = circular_mean(turned);
    ASSERT_TRUE(before && after);
    EXPECT_NEAR(angle_difference(after->direction_rad, before->direction_rad + turn), 0.0, 1e-9);
    EXPECT_NEAR(after->resultant_length, before->resultant_length, 1e-12);
  }
}

TEST(CircularMean, IsEmptyWhereNoDirectionIsMeant) {
  EXPECT_FALSE(circular_mean({}));
  EXPECT_FALSE(circular_mean(std::vector<double>{0.0, std::numbers::pi}));
  EXPECT_FALSE(circular_mean(std::vector<double>{0.1, 0.1 + 2.0 * std::numbers::pi / 3.0,
                                                 0.1 - 2.0 * std::numbers::pi / 3.0}));
}

TEST(CircularStandardDeviation, IsThatOfANarrowNormalDistribution) {
  Random random(13);
  std::vector<double> angles(50'000);
  for (double& a : angles) a = random.normal(3.0, 0.2);
  const auto mean = circular_mean(angles);
  ASSERT_TRUE(mean);
  EXPECT_NEAR(circular_standard_deviation(*mean), 0.2, 5.0 * 0.2 / std::sqrt(2.0 * 50'000.0));
  EXPECT_EQ(circular_standard_deviation({1.0, 1.0}), 0.0);
}

}  // namespace
}  // namespace panonav
