#include "lab/baselines/expected_image_homing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/toy_world.hpp"

namespace panonav::lab {
using namespace testing;
namespace {

// Surroundings on a cylinder of radius 1 m around (0, 0).
ToyWorld surroundings(std::uint64_t seed) {
  Random random(seed);
  std::vector<CylinderWave> waves;
  for (int k = 1; k <= 10; ++k) {
    const double amplitude = random.uniform(0.1, 0.3) / k;
    waves.push_back({k, 0.0, amplitude, random.uniform(-std::numbers::pi, std::numbers::pi)});
  }
  return waved_cylinder(1.0, std::move(waves));
}

// The row that a robot sees from (x, y) with this heading.
std::vector<float> seen_from(const ToyWorld& around, double x, double y, double heading,
                             int columns) {
  const Panorama view = around.panorama({x, y, heading}, 1, columns);
  return {view.values().begin(), view.values().end()};
}

struct Answer {
  double xi, eta;
  int turn;
  double difference;
};

// [S06 eq. 8, 9], term by term.
Answer brute_force(const ExpectedImageHoming& homing, const std::vector<float>& home,
                   const std::vector<float>& current) {
  const int n = homing.columns();
  Answer best{0, 0, 0, std::numeric_limits<double>::infinity()};
  double home_mean = 0.0;
  for (const float v : home) home_mean += static_cast<double>(v) / n;
  for (const auto& position : homing.positions()) {
    std::vector<double> expected;
    double mean = 0.0;
    for (int i = 0; i < n; ++i) {
      const double phi = 2.0 * std::numbers::pi * i / n;
      const double at = i + n / (2.0 * std::numbers::pi) *
                                (-static_cast<double>(position.xi) * std::sin(phi) +
                                 static_cast<double>(position.eta) * std::cos(phi));
      const int pixel = (static_cast<int>(std::nearbyint(at)) % n + n) % n;
      expected.push_back(static_cast<double>(current[pixel]));
      mean += expected.back() / n;
    }
    for (int s = 0; s < n; ++s) {
      double sum = 0.0;
      for (int i = 0; i < n; ++i) {
        const double d =
            (static_cast<double>(home[(i - s + n) % n]) - home_mean) - (expected[i] - mean);
        sum += d * d;
      }
      if (sum < best.difference) best = {position.xi, position.eta, s, sum};
    }
  }
  return best;
}

TEST(ExpectedImageHoming, FindsWhatTryingEveryPositionAndTurnFinds) {
  Random random(4);
  int trials = 0;
  for (const int columns : {36, 72, 90}) {
    const ExpectedImageHoming homing(columns, 60);
    for (int trial = 0; trial < 6; ++trial, ++trials) {
      const ToyWorld around = surroundings(50 + trial);
      const auto home = seen_from(around, 0.0, 0.0, 0.4, columns);
      auto current = seen_from(around, random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4),
                               random.uniform(-std::numbers::pi, std::numbers::pi), columns);
      for (float& v : current) v += static_cast<float>(random.normal(0.0, 0.02));
      const Answer truth = brute_force(homing, home, current);
      const HomeVector v = homing.home_vector(home, current);
      EXPECT_EQ(v.xi, truth.xi);
      EXPECT_EQ(v.eta, truth.eta);
      EXPECT_NEAR(angle_difference(v.heading_rad, 2.0 * std::numbers::pi * truth.turn / columns),
                  0.0, 1e-9);
    }
  }
  EXPECT_EQ(trials, 18);
}

TEST(ExpectedImageHoming, PointsHomeAndTellsDistanceAndHeadingWhereAllThingsAreEquallyFar) {
  Random random(8);
  constexpr int columns = 180;
  const ExpectedImageHoming homing(columns, 600);
  for (int trial = 0; trial < 12; ++trial) {
    const ToyWorld around = surroundings(trial);
    const double angle = random.uniform(-std::numbers::pi, std::numbers::pi);
    const double heading = random.uniform(-std::numbers::pi, std::numbers::pi);
    constexpr double d = 0.2;
    const auto home = seen_from(around, 0.0, 0.0, 0.0, columns);
    const auto current =
        seen_from(around, d * std::cos(angle), d * std::sin(angle), heading, columns);
    const HomeVector v = homing.home_vector(home, current);
    EXPECT_LT(std::abs(angle_difference(v.direction_rad(), angle + std::numbers::pi - heading)),
              radians(20.0));
    EXPECT_NEAR(v.length(), d, 0.07);
    EXPECT_LT(std::abs(angle_difference(v.heading_rad, -heading)), radians(3.0));
  }
}

TEST(ExpectedImageHoming, ATurnByWholePixelsTurnsTheVectorAndNothingElse) {
  constexpr int columns = 72;
  const ExpectedImageHoming homing(columns);
  const ToyWorld around = surroundings(3);
  const auto home = seen_from(around, 0.0, 0.0, 0.3, columns);
  const auto current = seen_from(around, 0.2, -0.1, 1.0, columns);
  // A quarter turn maps the lattice of positions onto itself.
  std::vector<float> turned(columns);
  for (int c = 0; c < columns; ++c) turned[c] = current[(c + columns / 4) % columns];
  const HomeVector a = homing.home_vector(home, current);
  const HomeVector b = homing.home_vector(home, turned);
  EXPECT_GT(a.length(), 0.1);
  EXPECT_NEAR(b.xi, a.eta, 1e-6);
  EXPECT_NEAR(b.eta, -a.xi, 1e-6);
  EXPECT_NEAR(angle_difference(b.heading_rad, a.heading_rad - std::numbers::pi / 2.0), 0.0, 1e-9);
}

TEST(ExpectedImageHoming, IdenticalViewsAreHomeAndFlatOnesTellNothing) {
  constexpr int columns = 72;
  const ExpectedImageHoming homing(columns);
  const auto view = seen_from(surroundings(6), 0.1, 0.0, 0.0, columns);
  const HomeVector here = homing.home_vector(view, view);
  EXPECT_EQ(here.length(), 0.0);
  EXPECT_EQ(here.heading_rad, 0.0);
  EXPECT_FALSE(here.has_direction());
  EXPECT_NEAR(here.residual, 0.0, 1e-5);
  EXPECT_NEAR(here.correlation, 1.0, 1e-5);
  const std::vector<float> flat(columns, 0.4F);
  const HomeVector lost = homing.home_vector(flat, view);
  EXPECT_EQ(lost.length(), 0.0);
  EXPECT_EQ(lost.residual, 1.0);
}

TEST(ExpectedImageHoming, HasThePublishedTable) {
  const ExpectedImageHoming homing(360);
  EXPECT_EQ(homing.positions().size(), 197U);
  EXPECT_EQ(homing.positions()[0].xi, 0.0F);
  double farthest = 0.0;
  for (const auto& p : homing.positions()) {
    farthest =
        std::max(farthest, std::hypot(static_cast<double>(p.xi), static_cast<double>(p.eta)));
  }
  EXPECT_LT(farthest, 2.0 / 3.0);
  EXPECT_GT(farthest, 0.6);
  for (int i = 0; i < 360; ++i) EXPECT_EQ(homing.expected_pixel_indices(0)[i], i);
}

TEST(ExpectedImageHoming, RefusesWhatItCannotCompare) {
  EXPECT_THROW(ExpectedImageHoming(3), ContractError);
  EXPECT_THROW(ExpectedImageHoming(72, 4), ContractError);
  const ExpectedImageHoming homing(8);
  std::vector<float> row(8, 0.5F);
  EXPECT_THROW((void)homing.home_vector(row, std::vector<float>(7)), ContractError);
  row[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW((void)homing.home_vector(row, row), ContractError);
}

}  // namespace
}  // namespace panonav::lab
