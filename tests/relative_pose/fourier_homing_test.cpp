#include "panonav/relative_pose/fourier_homing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/random_views.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

HeadingWindow heading_window(double middle_rad, double half_width_rad) {
  return {static_cast<float>(middle_rad), static_cast<float>(half_width_rad)};
}

constexpr ElevationBand band{-0.6, 0.6};

// The view from (x, y) of a robot with this heading.
Panorama seen_from(const ToyWorld& around, double x, double y, double heading, int rows) {
  return around.panorama({x, y, heading}, rows, 256, rows > 1 ? std::optional(band) : std::nullopt);
}

HomingView view_of(const Panorama& panorama, int components = 16) {
  return homing_view(compute_signature(panorama, components));
}

// [S06 eq. 21-26]: what a small displacement does to the coefficients is the derivative of the
// expected image, here taken numerically.
TEST(FourierHoming, SlopesOfThePublishedFormulasAreDerivativesOfTheExpectedImage) {
  Random random(3);
  constexpr int highest = 9;
  std::vector<double> a(highest + 1);
  std::vector<double> b(highest + 1);
  for (int k = 1; k <= highest; ++k) {
    a[k] = random.uniform(-1.0, 1.0);
    b[k] = random.uniform(-1.0, 1.0);
  }
  const auto image = [&](double phi) {
    double value = 0.0;
    for (int k = 1; k <= highest; ++k) value += a[k] * std::cos(k * phi) + b[k] * std::sin(k * phi);
    return value;
  };
  constexpr int columns = 512;
  // I^e(phi | xi, eta) [S06 eq. 4].
  const auto coefficient = [&](int k, bool sine, double xi, double eta) {
    double sum = 0.0;
    for (int c = 0; c < columns; ++c) {
      const double phi = 2.0 * std::numbers::pi * c / columns;
      const double value = image(phi - xi * std::sin(phi) + eta * std::cos(phi));
      sum += value * (sine ? std::sin(k * phi) : std::cos(k * phi));
    }
    return 2.0 * sum / columns;
  };
  constexpr double h = 1e-4;
  for (int k = 1; k < highest; ++k) {
    const auto slope = [&](bool sine, bool y) {
      return (coefficient(k, sine, y ? 0 : h, y ? h : 0) -
              coefficient(k, sine, y ? 0 : -h, y ? -h : 0)) /
             (2.0 * h);
    };
    EXPECT_NEAR(slope(false, false), 0.5 * (-(k - 1) * a[k - 1] + (k + 1) * a[k + 1]), 1e-5);
    EXPECT_NEAR(slope(false, true), 0.5 * ((k - 1) * b[k - 1] + (k + 1) * b[k + 1]), 1e-5);
    EXPECT_NEAR(slope(true, false), 0.5 * (-(k - 1) * b[k - 1] + (k + 1) * b[k + 1]), 1e-5);
    EXPECT_NEAR(slope(true, true), 0.5 * (-(k - 1) * a[k - 1] - (k + 1) * a[k + 1]), 1e-5);
  }
}

struct Rule {
  const char* name;
  FourierHomingOptions options;
};
class EveryRule : public ::testing::TestWithParam<Rule> {};

TEST_P(EveryRule, PointsHomeAndTellsDistanceAndHeadingWhereAllThingsAreEquallyFar) {
  Random random(11);
  for (int trial = 0; trial < 40; ++trial) {
    const ToyWorld around = random_surroundings(100 + trial);
    const double angle = random.uniform(-std::numbers::pi, std::numbers::pi);
    const double heading = random.uniform(-std::numbers::pi, std::numbers::pi);
    constexpr double d = 0.02;
    const double x = d * std::cos(angle);
    const double y = d * std::sin(angle);
    const HomingView home = view_of(seen_from(around, 0.0, 0.0, 0.0, 1));
    const HomingView current = view_of(seen_from(around, x, y, heading, 1));
    const HomeVector v = home_vector(home, current, GetParam().options);
    const double truth = std::atan2(-y, -x) - heading;
    EXPECT_LT(std::abs(angle_difference(v.direction_rad(), truth)), radians(12.0)) << trial;
    EXPECT_NEAR(v.length(), d, 0.25 * d) << trial;
    EXPECT_LT(std::abs(angle_difference(v.heading_rad, -heading)), radians(0.5)) << trial;
    EXPECT_TRUE(v.has_direction()) << trial;
    EXPECT_LT(v.residual, 0.01) << trial;
  }
}

TEST_P(EveryRule, TurningTheRobotTurnsTheVectorAndNothingElse) {
  for (int trial = 0; trial < 20; ++trial) {
    const ToyWorld around = random_surroundings(200 + trial, 2.0);
    const HomingView home = view_of(seen_from(around, 0.0, 0.0, 0.3, 12));
    const HomingView current = view_of(seen_from(around, 0.1, -0.05, 1.0, 12));
    const HomeVector v = home_vector(home, current, GetParam().options);
    constexpr double delta = 2.1;
    const HomeVector other = home_vector(home, rotate(current, delta), GetParam().options);
    EXPECT_NEAR(std::cos(delta) * v.xi + std::sin(delta) * v.eta, other.xi, 1e-4);
    EXPECT_NEAR(-std::sin(delta) * v.xi + std::cos(delta) * v.eta, other.eta, 1e-4);
    EXPECT_NEAR(angle_difference(v.heading_rad - delta, other.heading_rad), 0.0, 1e-4);
    EXPECT_NEAR(v.residual, other.residual, 1e-4);
    const HomeVector same = home_vector(rotate(home, -1.3), current, GetParam().options);
    EXPECT_NEAR(same.xi, v.xi, 1e-4);
    EXPECT_NEAR(same.eta, v.eta, 1e-4);
    EXPECT_NEAR(angle_difference(v.heading_rad - 1.3, same.heading_rad), 0.0, 1e-4);
  }
}

TEST_P(EveryRule, IdenticalViewsGiveNoDirection) {
  for (const int rows : {1, 12}) {
    const ToyWorld around = random_surroundings(7, 2.0);
    const HomingView home = view_of(seen_from(around, 0.0, 0.0, 0.0, rows));
    for (const double heading : {0.0, 1.7}) {
      const HomeVector v = home_vector(home, rotate(home, heading), GetParam().options);
      EXPECT_LT(v.length(), 1e-4);
      EXPECT_FALSE(v.has_direction());
      EXPECT_NEAR(angle_difference(v.heading_rad, -heading), 0.0, 1e-4);
      EXPECT_NEAR(v.correlation, 1.0, 1e-5);
    }
    const HomeVector exact = home_vector(home, home, GetParam().options);
    EXPECT_FALSE(exact.has_direction());
    EXPECT_TRUE(std::isfinite(exact.direction_rad()));
  }
}

TEST_P(EveryRule, ViewsWithoutStructureGiveNothingAndNoNaN) {
  const HomingView blank = view_of(Panorama(4, 64, band));
  const HomingView seen = view_of(seen_from(random_surroundings(5, 1.0), 0, 0, 0, 4));
  for (const auto& [home, current] :
       {std::pair(blank, blank), std::pair(blank, seen), std::pair(seen, blank)}) {
    const HomeVector v = home_vector(home, current, GetParam().options);
    EXPECT_EQ(v.length(), 0.0);
    EXPECT_FALSE(v.has_direction());
    EXPECT_EQ(v.residual, 1.0);
  }
  // One frequency alone, the second of each view only, and so on.
  for (int only = 1; only < 8; ++only) {
    std::vector<float> a(10);
    a[only] = 0.4F;
    const HomingView wave(1, 10, a, std::vector<float>(10));
    for (const auto* other : {&wave}) {
      const HomeVector v = home_vector(wave, rotate(*other, 0.2), GetParam().options);
      EXPECT_TRUE(std::isfinite(v.xi) && std::isfinite(v.eta) && std::isfinite(v.heading_rad));
      EXPECT_TRUE(std::isfinite(v.residual) &&
                  std::ranges::all_of(v.covariance, [](double c) { return std::isfinite(c); }));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Rules, EveryRule,
    ::testing::Values(Rule{"ours", {}}, Rule{"published", published_homing_options(5)},
                      Rule{"published_iterated", published_homing_options(8, 2)},
                      Rule{"rising", {.highest = 8, .iterations = 2, .rising = true}},
                      Rule{"equal_weights", {.weights = FourierHomingOptions::Weights::equal}},
                      Rule{"several_starts", {.starting_estimates = 4}}),
    [](const auto& rule) { return std::string(rule.param.name); });

TEST(FourierHoming, IterationsExplainAFarViewBetter) {
  double residual_once = 0.0;
  double residual_often = 0.0;
  double length_once = 0.0;
  double length_often = 0.0;
  for (int trial = 0; trial < 30; ++trial) {
    const ToyWorld around = random_surroundings(300 + trial);
    const HomingView home = view_of(seen_from(around, 0.0, 0.0, 0.0, 1), 40);
    const HomingView current = view_of(seen_from(around, 0.3, 0.0, 0.0, 1), 40);
    const HomeVector once = home_vector(home, current, published_homing_options(8));
    const HomeVector often = home_vector(home, current, published_homing_options(8, 4));
    residual_once += once.residual;
    residual_often += often.residual;
    length_once += std::abs(once.length() - 0.3);
    length_often += std::abs(often.length() - 0.3);
  }
  EXPECT_LT(residual_often, 0.8 * residual_once);
  EXPECT_LT(length_often, length_once);
}

// View of a robot that pitches: the direction u comes from u - omega x u.
Panorama tilted_panorama(const Panorama& level, double tilt) {
  Panorama result = level;
  const double row_rad = (band.top_rad - band.bottom_rad) / level.rows();
  for (int r = 0; r < level.rows(); ++r) {
    for (int c = 0; c < level.columns(); ++c) {
      const double phi = level.azimuth_rad(c);
      const double elevation = level.elevation_rad(r);
      const double from_row =
          std::clamp(r + tilt * std::cos(phi) / row_rad, 0.0, level.rows() - 1.001);
      const double from_column = (phi - tilt * std::tan(elevation) * std::sin(phi)) *
                                     level.columns() / (2.0 * std::numbers::pi) +
                                 level.columns();
      const int r0 = static_cast<int>(from_row);
      const int c0 = static_cast<int>(std::floor(from_column));
      const auto fr = static_cast<float>(from_row - r0);
      const auto fc = static_cast<float>(from_column - c0);
      const auto at = [&](int row, int column) { return level.at(row, column % level.columns()); };
      result.at(r, c) = (1 - fr) * ((1 - fc) * at(r0, c0) + fc * at(r0, c0 + 1)) +
                        fr * ((1 - fc) * at(r0 + 1, c0) + fc * at(r0 + 1, c0 + 1));
    }
  }
  return result;
}

TEST(FourierHoming, LeanIsToldFromDisplacement) {
  double with = 0.0;
  double without = 0.0;
  for (int trial = 0; trial < 30; ++trial) {
    const ToyWorld around = random_surroundings(600 + trial, 6.0);
    const HomingView home = view_of(seen_from(around, 0.0, 0.0, 0.0, 40));
    const HomingView current =
        view_of(tilted_panorama(seen_from(around, 0.05, 0.03, 0.0, 40), radians(1.5)));
    const auto error = [&](bool solved) {
      const HomeVector v = home_vector(home, current, {.tilt = solved});
      return std::hypot(v.xi + 0.05, v.eta + 0.03);
    };
    with += error(true);
    without += error(false);
  }
  EXPECT_LT(with, 0.6 * without);
}

// A robot that is home looks at home, also where the ground is not even.
TEST(ImageDifference, LeanIsNotADifference) {
  double tilted_at_home = 0.0;
  double flat = 0.0;
  for (int trial = 0; trial < 30; ++trial) {
    const ToyWorld around = random_surroundings(700 + trial, 6.0);
    const Panorama level = seen_from(around, 0.0, 0.0, 0.0, 40);
    const Panorama tilted = tilted_panorama(level, radians(1.5));
    tilted_at_home += image_difference(view_of(level), rotate(view_of(tilted), 1.0)) / 30;
    // Without elevations nothing is known of a tilt.
    const auto bare = [](const Panorama& view) {
      return view_of(Panorama(view.rows(), view.columns(), std::nullopt,
                              {view.values().begin(), view.values().end()}));
    };
    flat += image_difference(bare(level), rotate(bare(tilted), 1.0)) / 30;
  }
  EXPECT_LT(tilted_at_home, 0.4 * flat);
}

// A feature off the horizon moves up and down as the robot moves to and from it.
TEST(FourierHoming, VerticalMotionIsTakenIntoAccount) {
  double with = 0.0;
  double without = 0.0;
  for (int trial = 0; trial < 30; ++trial) {
    const ToyWorld around = random_surroundings(400 + trial, 6.0);
    const HomingView home = view_of(seen_from(around, 0.0, 0.0, 0.0, 24));
    const HomingView current = view_of(seen_from(around, 0.05, 0.03, 0.0, 24));
    const auto error = [&](bool vertical) {
      const HomeVector v = home_vector(
          home, current,
          {.weights = FourierHomingOptions::Weights::equal, .vertical_motion = vertical});
      return std::hypot(v.xi + 0.05, v.eta + 0.03);
    };
    with += error(true);
    without += error(false);
  }
  EXPECT_LT(with / 30.0, 0.005);
  EXPECT_LT(with, 0.5 * without);
}

TEST(FourierHoming, SearchFindsTheWayFromFarAway) {
  double with = 0.0;
  double without = 0.0;
  Random random(77);
  for (int trial = 0; trial < 60; ++trial) {
    const ToyWorld around = random_surroundings(500 + trial);
    const double angle = random.uniform(-std::numbers::pi, std::numbers::pi);
    const HomingView home = view_of(seen_from(around, 0.0, 0.0, 0.0, 1), 20);
    const HomingView current =
        view_of(seen_from(around, 0.55 * std::cos(angle), 0.55 * std::sin(angle), 2.0, 1), 20);
    const auto component = [&](bool search) {
      const HomeVector v = home_vector(home, current, {.displacement_search = search});
      return std::cos(v.direction_rad() - (angle + std::numbers::pi - 2.0));
    };
    with += component(true);
    without += component(false);
  }
  EXPECT_GT(with / 60.0, 0.8);
  EXPECT_GT(with, without);
}

TEST(FourierHoming, CoherenceTakesFewerFrequenciesFromAfar) {
  const ToyWorld around = random_surroundings(9);
  const HomingView home = view_of(seen_from(around, 0.0, 0.0, 0.0, 1));
  double before = 100.0;
  for (const double d : {0.01, 0.2, 0.5, 0.8}) {
    const HomeVector v = home_vector(home, view_of(seen_from(around, d, 0.0, 0.0, 1)),
                                     {.displacement_search = false});
    EXPECT_LE(v.frequencies, before + 0.5) << d;
    before = v.frequencies;
  }
  EXPECT_LT(before, 10.0);
}

TEST(FourierHoming, DifferenceIsZeroAtHomeAndGrowsWithTheDistance) {
  const ToyWorld around = random_surroundings(21);
  const HomingView home = view_of(seen_from(around, 0.0, 0.0, 0.0, 1));
  EXPECT_NEAR(image_difference(home, rotate(home, 0.8)), 0.0, 1e-5);
  double before = 0.0;
  for (const double d : {0.02, 0.1, 0.3}) {
    const double difference = image_difference(home, view_of(seen_from(around, d, 0.0, 1.0, 1)));
    EXPECT_GT(difference, before);
    before = difference;
  }
  EXPECT_EQ(image_difference(home, view_of(Panorama(1, 64, std::nullopt))), 1.0);
}

// Surroundings that look alike after a quarter turn, but for a little.
TEST(FourierHoming, ATurnKnownCoarselyTellsAlikeTurnsApart) {
  int told_apart = 0;
  for (int trial = 0; trial < 20; ++trial) {
    Random random(900 + trial);
    std::vector<CylinderWave> waves;
    for (int k = 1; k <= 12; ++k) {
      waves.push_back({k, 0.0, k % 4 == 0 ? random.uniform(0.05, 0.1) : 0.004,
                       random.uniform(-std::numbers::pi, std::numbers::pi)});
    }
    const ToyWorld around = waved_cylinder(1.0, std::move(waves));
    const HomingView home = view_of(seen_from(around, 0.0, 0.0, 0.0, 1));
    const HomingView current = view_of(seen_from(around, 0.05, 0.02, 0.3, 1));
    for (int quarter = -1; quarter <= 2; ++quarter) {
      const double middle = -0.3 + quarter * 0.5 * std::numbers::pi;
      const HomeVector near =
          home_vector(home, current, {}, heading_window(middle, 0.25 * std::numbers::pi));
      if (near.residual >= 1.0) continue;
      EXPECT_NEAR(angle_difference(near.heading_rad, middle), 0.0, 0.25 * std::numbers::pi + 0.1);
      ++told_apart;
    }
    const HomeVector right =
        home_vector(home, current, {}, heading_window(0.0, 0.25 * std::numbers::pi));
    EXPECT_NEAR(right.heading_rad, -0.3, 0.1);
    // Without bounds it is what `home_vector` finds.
    EXPECT_EQ(home_vector(home, current, {}, heading_window(1.0, std::numbers::pi)).heading_rad,
              home_vector(home, current).heading_rad);
  }
  EXPECT_GE(told_apart, 60);
  const HomingView one = view_of(seen_from(random_surroundings(1), 0, 0, 0, 1));
  EXPECT_THROW((void)home_vector(one, one, {}, heading_window(NAN, 1.0)), ContractError);
  EXPECT_THROW((void)home_vector(one, one, {}, heading_window(0.0, 0.0)), ContractError);
  EXPECT_THROW((void)home_vector(one, one, published_homing_options(3), heading_window(0.0, 1.0)),
               ContractError);
}

// Bounds may hold no turn at which the views correlate: the best one there is taken all the same.
TEST(FourierHoming, ATurnWithinBoundsMayCorrelateNegatively) {
  int negative = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const HomingView home = view_of(seen_from(random_surroundings(trial), 0, 0, 0, 1));
    const HomingView current = view_of(seen_from(random_surroundings(trial + 100), 0, 0, 0, 1));
    for (const double middle : {-2.0, 0.0, 2.0}) {
      const HomeVector near = home_vector(home, current, {}, heading_window(middle, 0.5));
      if (!(near.correlation < 0.0)) continue;
      EXPECT_GT(near.frequencies, 0.0);
      ++negative;
    }
  }
  EXPECT_GE(negative, 3);
}

// Solving is left out only where it cannot change the correlation.
TEST(FourierHoming, TheCorrelationAloneIsThatOfTheVectorToTheBit) {
  std::vector<FourierHomingOptions> rules(5);
  rules[1].displacement_search = false;
  rules[2].displacement_search = false;
  rules[2].starting_estimates = max_starting_estimates;
  rules[3].iterations = 2;
  rules[4] = published_homing_options(5);
  std::vector<int> different(rules.size(), 0);
  for (int trial = 0; trial < 20; ++trial) {
    const int rows = trial % 2 == 0 ? 1 : 12;
    const ToyWorld world = random_surroundings(trial, 1.0);
    const HomingView home = view_of(seen_from(world, 0, 0, 0, rows));
    const HomingView near = view_of(seen_from(world, 0.2, 0.1, 1.0, rows));
    const HomingView other = view_of(seen_from(random_surroundings(trial + 50), 0, 0, 0, rows));
    for (const HomingView& current : {near, other}) {
      for (std::size_t i = 0; i < rules.size(); ++i) {
        const double alone = home_vector_correlation(home, current, rules[i]);
        EXPECT_EQ(alone, home_vector(home, current, rules[i]).correlation) << trial << " " << i;
        different[i] += alone != home_vector_correlation(home, current, rules[0]) ? 1 : 0;
        if (i == 4) continue;  // takes no window
        const auto window = heading_window(0.5, 0.4);
        EXPECT_EQ(home_vector_correlation(home, current, rules[i], window),
                  home_vector(home, current, rules[i], window).correlation);
      }
    }
  }
  for (std::size_t i = 1; i < rules.size(); ++i) EXPECT_GE(different[i], 5) << i;  // guard
  const HomingView flat(1, 4, std::vector<float>(4), std::vector<float>(4), std::nullopt);
  EXPECT_EQ(home_vector_correlation(flat, flat), 0.0);
}

TEST(FourierHoming, RefusesViewsThatDoNotFit) {
  const HomingView one = view_of(seen_from(random_surroundings(1), 0, 0, 0, 1));
  const HomingView four = view_of(seen_from(random_surroundings(1), 0, 0, 0, 4));
  EXPECT_THROW((void)home_vector(one, four), ContractError);
  EXPECT_THROW((void)home_vector(one, one, {.highest = 15}), ContractError);
  EXPECT_NO_THROW((void)home_vector(one, one, {.highest = 14}));
  EXPECT_THROW((void)home_vector(one, one, {.iterations = -1}), OptionError);
  EXPECT_THROW((void)image_difference(one, four), ContractError);
  EXPECT_THROW((void)HomingView(1, 2, {0.0F, 1.0F}, {0.1F, 1.0F}), ContractError);
  EXPECT_THROW((void)HomingView(1, 2, {0.0F, NAN}, {0.0F, 1.0F}), ContractError);
  EXPECT_THROW((void)HomingView(1, 2, {0.0F}, {0.0F, 1.0F}), ContractError);
  EXPECT_THROW((void)first_components(one, 17), ContractError);
}

TEST(HomingView, HorizonViewIsTheMeanOfTheRowsAroundTheHorizon) {
  const ToyWorld around = random_surroundings(31, 3.0);
  const Panorama panorama = seen_from(around, 0, 0, 0, 12);
  const FourierSignature signature = compute_signature(panorama, 10);
  const HomingView middle = horizon_view(signature, 0.11);  // rows at +-0.05 only
  ASSERT_EQ(middle.rows(), 1);
  for (int k = 0; k < 10; ++k) {
    const HomingView all = homing_view(signature);
    EXPECT_NEAR(middle.a(0, k), 0.5F * (all.a(5, k) + all.a(6, k)), 1e-6F);
    EXPECT_NEAR(middle.b(0, k), 0.5F * (all.b(5, k) + all.b(6, k)), 1e-6F);
  }
}

}  // namespace
}  // namespace panonav::testing
