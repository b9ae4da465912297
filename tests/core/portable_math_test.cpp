// Elementary functions without the C library: their errors, and special values.

#include "panonav/core/portable_math.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/core/random.hpp"

namespace panonav {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

double error_in_last_places(double found, double truth) {
  return std::abs(found - truth) / (epsilon * std::max(std::abs(truth), 1e-300));
}

TEST(PortableMath, IsWithinTwoUnitsInTheLastPlace) {
  constexpr double max_error = 2.0;
  Random random(1);
  for (int i = 0; i < 100000; ++i) {
    const double angle = random.uniform(-1000.0, 1000.0);
    EXPECT_LE(error_in_last_places(portable::sin(angle), std::sin(angle)), max_error) << angle;
    EXPECT_LE(error_in_last_places(portable::cos(angle), std::cos(angle)), max_error) << angle;
    const double x = random.uniform(-1.0, 1.0);
    const double y = random.uniform(-1.0, 1.0);
    EXPECT_LE(error_in_last_places(portable::atan2(y, x), std::atan2(y, x)), max_error);
    EXPECT_LE(error_in_last_places(portable::asin(x), std::asin(x)), max_error) << x;
    EXPECT_LE(error_in_last_places(portable::hypot(x, y), std::hypot(x, y)), max_error);
    const double exponent = random.uniform(-650.0, 650.0);
    EXPECT_LE(error_in_last_places(portable::exp(exponent), std::exp(exponent)), max_error);
    const double power = std::exp(exponent);
    EXPECT_LE(error_in_last_places(portable::log(power), std::log(power)), max_error) << power;
  }
}

TEST(PortableMath, HasTheSpecialValuesOfTheLibrary) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(portable::sin(0.0), 0.0);
  EXPECT_EQ(portable::cos(0.0), 1.0);
  EXPECT_TRUE(std::isnan(portable::sin(infinity)));
  EXPECT_TRUE(std::isnan(portable::cos(nan)));
  for (const double y : {0.0, -0.0, 1.0, -1.0}) {
    for (const double x : {0.0, -0.0, 1.0, -1.0}) {
      EXPECT_EQ(portable::atan2(y, x), std::atan2(y, x)) << y << ' ' << x;
      EXPECT_EQ(std::signbit(portable::atan2(y, x)), std::signbit(std::atan2(y, x)));
    }
  }
  EXPECT_TRUE(std::isnan(portable::atan2(nan, 1.0)));
  EXPECT_TRUE(std::isnan(portable::atan2(1.0, nan)));
  EXPECT_TRUE(std::isnan(portable::asin(1.5)));
  EXPECT_EQ(portable::exp(0.0), 1.0);
  EXPECT_EQ(portable::exp(-infinity), 0.0);
  EXPECT_EQ(portable::exp(infinity), infinity);
  EXPECT_TRUE(std::isnan(portable::exp(nan)));
  EXPECT_EQ(portable::log(1.0), 0.0);
  EXPECT_EQ(portable::log(0.0), -infinity);
  EXPECT_EQ(portable::log(infinity), infinity);
  EXPECT_TRUE(std::isnan(portable::log(-1.0)));
  EXPECT_TRUE(std::isnan(portable::log(nan)));
  EXPECT_DOUBLE_EQ(portable::log(5e-324), std::log(5e-324));
  EXPECT_EQ(portable::power_of_two(-3), 0.125);
}

// Tables in flash memory are computed by the compiler.
TEST(PortableMath, IsConstantWhereItsArgumentsAre) {
  constexpr double pi = std::numbers::pi;
  static_assert(portable::cosine_sine(0.0).cosine == 1.0);
  static_assert(portable::exp(0.0) == 1.0);
  static_assert(portable::log(1.0) == 0.0);
  EXPECT_NEAR(portable::cosine_sine(pi).sine, 0.0, 2e-16);
}

}  // namespace
}  // namespace panonav
