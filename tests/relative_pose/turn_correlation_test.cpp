#include "panonav/relative_pose/turn_correlation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/internal/displacement.hpp"
#include "panonav/relative_pose/internal/turn_bound.hpp"
#include "panonav/signature/correlation_point.hpp"

namespace panonav {
namespace {

void add(TurnCorrelation& correlation, double size, double phase_rad) {
  ++correlation.highest;
  const auto k = static_cast<std::size_t>(correlation.highest);
  correlation.real[k] = static_cast<float>(size * std::cos(phase_rad));
  correlation.imaginary[k] = static_cast<float>(size * std::sin(phase_rad));
}

double error_of(float turn_rad, double truth_rad) {
  return std::abs(angle_difference(static_cast<double>(turn_rad), truth_rad));
}

TEST(CorrelationAt, HasTheDerivativesOfItsValueInBothPrecisions) {
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<double> real{0.0};
    std::vector<double> imaginary{0.0};
    TurnCorrelation single;
    for (int k = 1; k <= 14; ++k) {
      const double size = random.uniform(0.0, 1.0) / k;
      const double phase = random.uniform(-3.0, 3.0);
      real.push_back(size * std::cos(phase));
      imaginary.push_back(size * std::sin(phase));
      add(single, size, phase);
    }
    const double turn = random.uniform(-3.0, 3.0);
    constexpr double step = 1e-5;
    const auto here = correlation_at<double>(real, imaginary, turn);
    const auto before = correlation_at<double>(real, imaginary, turn - step);
    const auto after = correlation_at<double>(real, imaginary, turn + step);
    EXPECT_NEAR(here.slope, (after.value - before.value) / (2.0 * step), 1e-6);
    EXPECT_NEAR(here.curvature, (after.slope - before.slope) / (2.0 * step), 1e-5);
    EXPECT_NEAR(static_cast<double>(single.at(static_cast<float>(turn))), here.value, 1e-4);
  }
}

// Components of views that differ by a turn alone all tell it, whatever their sizes.
TEST(TurnCorrelation, ATurnThatAllComponentsTellIsFoundByBothRules) {
  Random random(11);
  for (int trial = 0; trial < 100; ++trial) {
    const double turned = random.uniform(-3.1, 3.1);
    TurnCorrelation correlation;
    for (int k = 1; k <= 10; ++k) add(correlation, random.uniform(0.01, 1.0), k * turned);
    EXPECT_LT(error_of(sequential_heading(correlation), turned), 1e-4);
    std::array<float, 1> highest{};
    ASSERT_EQ(find_highest_peaks(correlation, highest), 1);
    EXPECT_LT(error_of(highest[0], turned), 1e-4);
  }
}

TEST(TurnCorrelation, BoundsItsMaximum) {
  Random random(12);
  for (int trial = 0; trial < 100; ++trial) {
    TurnCorrelation correlation;
    float all = 0.0F;
    for (int k = 1; k <= 1 + trial % 20; ++k) {
      const double size = random.uniform(0.0, 1.0);
      add(correlation, size, random.uniform(-3.1, 3.1));
      all += static_cast<float>(size);
    }
    float maximum = correlation.at(0.0F);
    for (float turn = 0.0F; turn < 6.3F; turn += 0.002F)
      maximum = std::max(maximum, correlation.at(turn));
    const float bound = bound_maximum(correlation);
    EXPECT_GE(bound, maximum - 1e-4F * all);
    EXPECT_LE(bound, maximum + 0.08F * all);
  }
}

// The search skips turns of displacements that cannot win; it must find what a full search finds.
TEST(Displacement, IsTheOneWithTheSmallestDifferenceOfAll) {
  Random random(13);
  constexpr std::size_t rows = 4;
  constexpr std::size_t frequencies = 14;
  constexpr std::size_t compared = max_searched_frequency;
  constexpr std::size_t stride = frequencies + 1;
  for (int trial = 0; trial < 60; ++trial) {
    std::vector<float> home_a, home_b, current_a, current_b;
    for (std::size_t i = 0; i < rows * stride; ++i) {
      const double size = 1.0 / static_cast<double>(1 + i % stride);
      for (auto* const values : {&home_a, &home_b, &current_a, &current_b})
        values->push_back(static_cast<float>(size * random.uniform(-1.0, 1.0)));
    }
    const HeadingWindow window{1.0F, trial % 2 == 0 ? 4.0F : 0.7F};
    const BestDisplacement found =
        find_displacement(home_a, home_b, current_a, current_b, rows, frequencies, window);
    const auto difference = [&](Displacement displacement) {
      TurnCorrelation correlation{.highest = compared};
      std::array<float, compared + 1> a;
      std::array<float, compared + 1> b;
      float energy = 0.0F;
      for (std::size_t first = 0; first < rows * stride; first += stride) {
        displace(displacement, std::span(current_a).subspan(first, stride),
                 std::span(current_b).subspan(first, stride), a, b);
        for (std::size_t k = 1; k <= compared; ++k) {
          const float ha = home_a[first + k];
          const float hb = home_b[first + k];
          correlation.real[k] += ha * a[k] + hb * b[k];
          correlation.imaginary[k] += ha * b[k] - hb * a[k];
          energy += ha * ha + hb * hb + a[k] * a[k] + b[k] * b[k];
        }
      }
      std::array<float, 1> turn{};
      if (find_highest_peaks(correlation, turn, window) == 0) return 1e9F;
      const auto ring = static_cast<float>(displacement.ring);
      return (energy - 2.0F * correlation.at(turn[0])) * (1.0F + 0.01F * ring * ring);
    };
    const float smallest = difference(found.displacement);
    for (int ring = 0; ring <= Displacement::rings; ++ring) {
      for (int direction = 0; direction < Displacement::directions; ++direction)
        EXPECT_LE(smallest, difference({ring, direction}) * 1.00001F);
    }
  }
}

TEST(SequentialTurn, TriesTheOppositeStartWhenTheFirstComponentIsWeak) {
  const auto misled_by_first = [](double size) {
    TurnCorrelation correlation;
    add(correlation, size, 0.4 + std::numbers::pi);
    for (int k = 2; k <= 5; ++k) add(correlation, 0.04, k * 0.4);
    return correlation;
  };
  // The rule as printed, without the second start, fails.
  EXPECT_LT(error_of(sequential_heading(misled_by_first(4e-6)), 0.4), 1e-3);
  // A strong first component that is wrong is believed: that is the rule, and why the other is
  // global.
  const TurnCorrelation strong = misled_by_first(0.25);
  std::array<float, 1> highest{};
  ASSERT_EQ(find_highest_peaks(strong, highest), 1);
  EXPECT_LE(strong.at(sequential_heading(strong)), strong.at(highest[0]) + 1e-6F);
}

}  // namespace
}  // namespace panonav
