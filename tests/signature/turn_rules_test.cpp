#include "panonav/signature/turn_rules.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {
namespace {

template <class Real>
struct Terms {
  std::vector<Real> real{0}, imaginary{0}, differences{0}, weights{0};

  void add(double size, double phase) {
    real.push_back(static_cast<Real>(size * std::cos(phase)));
    imaginary.push_back(static_cast<Real>(size * std::sin(phase)));
    const double k = static_cast<double>(weights.size());
    differences.push_back(static_cast<Real>(std::remainder(phase, 2.0 * std::numbers::pi)));
    weights.push_back(static_cast<Real>(size * k * k));
  }
  [[nodiscard]] CorrelationPoint<Real> at(Real turn_rad) const {
    return correlation_at<Real>(real, imaginary, turn_rad);
  }
  [[nodiscard]] Real sequential() const {
    return sequential_turn<Real>(differences, weights,
                                 [&](Real turn_rad) { return at(turn_rad).value; });
  }
};

TEST(CorrelationAt, HasTheDerivativesOfItsValueInBothPrecisions) {
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    Terms<double> terms;
    Terms<float> single;
    for (int k = 1; k <= 14; ++k) {
      const double size = random.uniform(0.0, 1.0) / k;
      const double phase = random.uniform(-3.0, 3.0);
      terms.add(size, phase);
      single.add(size, phase);
    }
    const double turn = random.uniform(-3.0, 3.0);
    constexpr double step = 1e-5;
    const auto here = terms.at(turn);
    const auto before = terms.at(turn - step);
    const auto after = terms.at(turn + step);
    EXPECT_NEAR(here.slope, (after.value - before.value) / (2.0 * step), 1e-6);
    EXPECT_NEAR(here.curvature, (after.slope - before.slope) / (2.0 * step), 1e-5);
    EXPECT_NEAR(static_cast<double>(single.at(static_cast<float>(turn)).value), here.value, 1e-4);
  }
}

// Components of views that differ by a turn alone all tell it, whatever their sizes; also where the
// first is too weak to count and points the other way.
TEST(SequentialTurn, FindsATurnThatAllComponentsTellInBothPrecisions) {
  Random random(4);
  for (int trial = 0; trial < 50; ++trial) {
    const double turn = random.uniform(-3.0, 3.0);
    const bool misled = trial % 2 == 1;
    Terms<double> terms;
    Terms<float> single;
    for (int k = 1; k <= 10; ++k) {
      const bool weak = misled && k == 1;
      const double size = weak ? 1e-6 : random.uniform(0.2, 1.0);
      const double phase = k * turn + (weak ? std::numbers::pi : 0.0);
      terms.add(size, phase);
      single.add(size, phase);
    }
    const double tolerance = misled ? 1e-3 : 1e-9;
    EXPECT_NEAR(angle_difference(terms.sequential(), turn), 0.0, tolerance);
    EXPECT_NEAR(angle_difference(static_cast<double>(single.sequential()), turn), 0.0, 1e-3);
  }
}

}  // namespace
}  // namespace panonav
