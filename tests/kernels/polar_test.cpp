#include "panonav/kernels/polar.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::kernels {
namespace {

TEST(ToPolar, AgreesWithDoublePrecisionAllOverThePlane) {
  Random random(1);
  std::vector<float> real, imaginary;
  // Around the circle at many lengths, on the axes and diagonals, and nothing at all.
  for (int i = 0; i < 5000; ++i) {
    const double angle = random.uniform(-3.2, 3.2);
    const double length = std::pow(10.0, random.uniform(-9.0, 3.0));
    real.push_back(static_cast<float>(length * std::cos(angle)));
    imaginary.push_back(static_cast<float>(length * std::sin(angle)));
  }
  for (const float x : {-1.0F, -0.0F, 0.0F, 1.0F, 0.41421356F}) {
    for (const float y : {-1.0F, -0.0F, 0.0F, 1.0F, 0.41421356F, 1e-9F, -1e-9F}) {
      real.push_back(x);
      imaginary.push_back(y);
    }
  }
  const float pi = std::acos(-1.0F);
  int checked = 0;
  for (const Instructions set : available_instructions()) {
    SCOPED_TRACE(std::string(name(set)));
    std::vector<float> magnitudes(real.size()), phases(real.size());
    to_polar(real, imaginary, magnitudes, phases, set);
    for (std::size_t i = 0; i < real.size(); ++i) {
      const double length =
          std::hypot(static_cast<double>(real[i]), static_cast<double>(imaginary[i]));
      ASSERT_NEAR(magnitudes[i], length, 3e-7 * length) << real[i] << " " << imaginary[i];
      ASSERT_GE(phases[i], -pi);
      ASSERT_LT(phases[i], pi);
      if (magnitudes[i] == 0.0F) {
        ASSERT_EQ(phases[i], 0.0F);
        continue;
      }
      const double error = std::remainder(
          phases[i] - std::atan2(static_cast<double>(imaginary[i]), static_cast<double>(real[i])),
          2.0 * std::acos(-1.0));
      ASSERT_LT(std::abs(error), 3e-7) << real[i] << " " << imaginary[i];
      ++checked;
    }
  }
  EXPECT_GT(checked, 5000);
}

TEST(ToPolar, TakesAnyNumberOfValues) {
  for (const Instructions set : available_instructions()) {
    for (int count = 0; count < 70; ++count) {
      std::vector<float> real(static_cast<std::size_t>(count), -3.0F), imaginary(real.size(), 4.0F);
      std::vector<float> magnitudes(real.size() + 1, -1.0F), phases(magnitudes);
      to_polar(real, imaginary, std::span(magnitudes).first(real.size()),
               std::span(phases).first(real.size()), set);
      for (int i = 0; i < count; ++i) {
        ASSERT_FLOAT_EQ(magnitudes[i], 5.0F);
        ASSERT_FLOAT_EQ(phases[i], std::atan2(4.0F, -3.0F));
      }
      ASSERT_EQ(magnitudes.back(), -1.0F);
      ASSERT_EQ(phases.back(), -1.0F);
    }
  }
}

TEST(ToPolar, RefusesSpansOfDifferentSizes) {
  std::vector<float> three(3), two(2);
  EXPECT_THROW(to_polar(three, two, three, three, Instructions::scalar), ContractError);
  EXPECT_THROW(to_polar(three, three, two, three, Instructions::scalar), ContractError);
  EXPECT_THROW(to_polar(three, three, three, two, Instructions::scalar), ContractError);
}

}  // namespace
}  // namespace panonav::kernels
