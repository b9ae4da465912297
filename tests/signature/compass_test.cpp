#include "panonav/signature/compass.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/random_views.hpp"

namespace panonav::testing {
namespace {

double correlation_at(const FourierSignature& query, const FourierSignature& reference,
                      double heading_rad) {
  double sum = 0.0;
  for (int k = 1; k < query.components(); ++k) {
    for (int y = 0; y < query.rows(); ++y) {
      sum += static_cast<double>(query.magnitude(y, k)) * reference.magnitude(y, k) *
             std::cos(static_cast<double>(query.phase_rad(y, k)) - reference.phase_rad(y, k) -
                      k * heading_rad);
    }
  }
  return sum;
}

double heading_error(const CompassReading& reading, double expected_rad) {
  return std::abs(angle_difference(reading.heading_rad, expected_rad));
}

TEST(Compass, ReadsAnyTurnOfTheSameView) {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const SignatureShape shape{1 + static_cast<int>(random.index(20)),
                               2 + static_cast<int>(random.index(30))};
    const FourierSignature reference = random_signature(random, shape);
    const double turned = random.uniform(-10.0, 10.0);
    const auto reading = compass(turn(reference, turned), reference);
    ASSERT_TRUE(reading);
    EXPECT_LT(heading_error(*reading, turned), 2e-5) << "trial " << trial;
    EXPECT_NEAR(reading->correlation, 1.0, 1e-5);
    EXPECT_GE(reading->heading_rad, -std::numbers::pi);
    EXPECT_LT(reading->heading_rad, std::numbers::pi);
  }
}

TEST(Compass, FindsTheGlobalMaximumOfUnrelatedViews) {
  // Many maxima of similar height: against a search over 20,000 headings.
  Random random(2);
  for (int trial = 0; trial < 60; ++trial) {
    const SignatureShape shape{1 + static_cast<int>(random.index(4)),
                               3 + static_cast<int>(random.index(20))};
    const FourierSignature query = random_signature(random, shape);
    const FourierSignature reference = random_signature(random, shape);
    double best = -1e9;
    for (int i = 0; i < 20000; ++i) {
      best = std::max(best, correlation_at(query, reference, 2.0 * std::numbers::pi * i / 20000));
    }
    const auto reading = compass(query, reference);
    ASSERT_TRUE(reading);
    const double at_reading = correlation_at(query, reference, reading->heading_rad);
    EXPECT_GE(at_reading, best * (1.0 - 1e-6));
    EXPECT_GT(best, 0.0);
  }
}

TEST(Compass, IsAntisymmetricAndAddsUp) {
  Random random(3);
  const FourierSignature a = random_signature(random, {10, 15});
  const FourierSignature b = random_signature(random, {10, 15});
  const auto ab = compass(a, b);
  const auto ba = compass(b, a);
  ASSERT_TRUE(ab && ba);
  EXPECT_LT(heading_error(*ab, -ba->heading_rad), 1e-5);
  EXPECT_NEAR(ab->correlation, ba->correlation, 1e-6);
  EXPECT_LT(ab->correlation, 0.9);  // they are different views
  const auto turned = compass(turn(a, 0.7), turn(b, -0.4));
  ASSERT_TRUE(turned);
  EXPECT_LT(heading_error(*turned, ab->heading_rad + 1.1), 1e-5);
}

TEST(Compass, HoldsTheSignConventionOnPanoramas) {
  // I'(phi) = I(phi + delta): turning the robot counter-clockwise by three columns.
  Random random(4);
  std::vector<float> values(6 * 64);
  for (float& value : values) value = static_cast<float>(random.uniform());
  const Panorama view(6, 64, std::nullopt, values);
  const auto reading = compass(compute_signature(rotate_columns(view, 3)), compute_signature(view));
  ASSERT_TRUE(reading);
  EXPECT_LT(heading_error(*reading, 2.0 * std::numbers::pi * 3 / 64), 1e-5);
}

TEST(Compass, ReadsBetweenColumnsOfBandLimitedViews) {
  // 24 columns are 15 degrees apart; the view has frequencies up to 7 only.
  Random random(5);
  const int columns = 24;
  const int rows = 5;
  struct Wave {
    double magnitude, phase;
  };
  std::vector<Wave> waves(static_cast<std::size_t>(rows) * 8);
  for (Wave& wave : waves) wave = {random.uniform(0.02, 0.1), random.uniform(-3.0, 3.0)};
  const auto view_at = [&](double heading_rad) {
    Panorama view(rows, columns, std::nullopt);
    for (int y = 0; y < rows; ++y) {
      for (int c = 0; c < columns; ++c) {
        double value = 0.5;
        for (int k = 1; k < 8; ++k) {
          const Wave& wave = waves[static_cast<std::size_t>(y) * 8 + k];
          value += wave.magnitude *
                   std::cos(k * (2.0 * std::numbers::pi * c / columns + heading_rad) + wave.phase);
        }
        view.at(y, c) = static_cast<float>(value);
      }
    }
    return compute_signature(view, 8);
  };
  const FourierSignature reference = view_at(0.0);
  for (int trial = 0; trial < 50; ++trial) {
    const double turned = random.uniform(-std::numbers::pi, std::numbers::pi);
    const auto reading = compass(view_at(turned), reference);
    ASSERT_TRUE(reading);
    EXPECT_LT(heading_error(*reading, turned), 1e-4) << "a column is 0.26 rad";
  }
}

TEST(Compass, NeedsNoFirstComponent) {
  Random random(6);
  FourierSignature with = random_signature(random, {4, 15});
  std::vector<float> magnitudes(with.magnitudes().begin(), with.magnitudes().end());
  std::vector<float> phases(with.phases_rad().begin(), with.phases_rad().end());
  for (int i = 0; i < 2 * 4; ++i) magnitudes[i] = phases[i] = 0.0F;
  const FourierSignature without(with.shape(), magnitudes, phases, std::nullopt);
  const auto reading = compass(turn(without, 2.0), without);
  ASSERT_TRUE(reading);
  EXPECT_LT(heading_error(*reading, 2.0), 1e-5);
}

TEST(Compass, SaysWhenAnotherHeadingFitsAsWell) {
  // Only even components: the view looks the same after half a turn.
  Random random(7);
  const FourierSignature view = random_signature(random, {4, 9});
  std::vector<float> magnitudes(view.magnitudes().begin(), view.magnitudes().end());
  std::vector<float> phases(view.phases_rad().begin(), view.phases_rad().end());
  for (int k = 1; k < 9; k += 2) {
    for (int y = 0; y < 4; ++y) magnitudes[k * 4 + y] = phases[k * 4 + y] = 0.0F;
  }
  const FourierSignature symmetric(view.shape(), magnitudes, phases, std::nullopt);
  const auto same = compass(symmetric, symmetric);
  ASSERT_TRUE(same);
  EXPECT_LT(same->distinctness, 1e-5);
  const auto distinct = compass(view, view);
  ASSERT_TRUE(distinct);
  EXPECT_GT(distinct->distinctness, 0.3);
  EXPECT_LE(distinct->distinctness, 1.0);
}

TEST(Compass, HasNoAnswerWithoutStructure) {
  Random random(8);
  const FourierSignature view = random_signature(random, {3, 15});
  const FourierSignature flat =
      compute_signature(Panorama(3, 512, std::nullopt, std::vector<float>(3 * 512, 0.7F)));
  EXPECT_FALSE(compass(flat, view));
  EXPECT_FALSE(compass(view, flat));
  EXPECT_FALSE(compass(flat, flat));
  EXPECT_FALSE(compass(pack(flat, 2.0F), pack(view, 2.0F)));
  EXPECT_TRUE(compass(view, view));
  // Only the mean: nothing to take a heading from.
  const FourierSignature mean_only = random_signature(random, {3, 1});
  EXPECT_FALSE(compass(mean_only, mean_only));
}

TEST(Compass, PackedAgreesWithFloat) {
  Random random(9);
  int compared = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const FourierSignature reference = random_signature(random, {40, 15});
    const double turned = random.uniform(-3.0, 3.0);
    const FourierSignature query = turn(reference, turned);
    const auto packed = compass(pack(query, 1.0F), pack(reference, 1.0F));
    ASSERT_TRUE(packed);
    EXPECT_LT(heading_error(*packed, turned), 2e-3);
    EXPECT_GT(packed->correlation, 0.999);
    ++compared;
  }
  EXPECT_EQ(compared, 100);
}

/// The definition of the correlation, over the bytes of packed signatures.
class PackedOracle {
 public:
  PackedOracle(const PackedSignature& query, const PackedSignature& reference) {
    double query_energy = 0.0;
    double reference_energy = 0.0;
    terms_.resize(static_cast<std::size_t>(query.shape.components));
    for (int k = 1; k < query.shape.components; ++k) {
      for (int y = 0; y < query.shape.rows; ++y) {
        const auto i = static_cast<std::size_t>(k * query.shape.rows + y);
        const double a = query.magnitudes[i];
        const double b = reference.magnitudes[i];
        terms_[k] +=
            std::polar(a * b, std::numbers::pi / 128.0 * (query.phases[i] - reference.phases[i]));
        query_energy += a * a;
        reference_energy += b * b;
      }
    }
    norm_ = std::sqrt(query_energy * reference_energy);
  }
  [[nodiscard]] double at(double heading_rad) const {
    double sum = 0.0;
    for (std::size_t k = 1; k < terms_.size(); ++k) {
      sum += (terms_[k] * std::polar(1.0, -static_cast<double>(k) * heading_rad)).real();
    }
    return sum / norm_;
  }
  [[nodiscard]] double best_within(double heading_rad, double within_rad) const {
    constexpr int steps = 4000;
    double best = -1.0;
    for (int i = 0; i <= steps; ++i) {
      best = std::max(best, at(heading_rad + within_rad * (2.0 * i / steps - 1.0)));
    }
    return best;
  }

 private:
  std::vector<std::complex<double>> terms_;
  double norm_ = 1.0;
};

/// The compass' cosines have 14 bits.
constexpr double packed_rounding = 1e-4;

struct PackedPair {
  PackedSignature query, reference;
};

PackedPair unrelated_views(Random& random) {
  const SignatureShape shape{1 + static_cast<int>(random.index(4)),
                             3 + static_cast<int>(random.index(20))};
  const auto draw = [&] { return pack(random_signature(random, shape), 1.0F); };
  PackedSignature query = draw();
  return {std::move(query), draw()};
}

TEST(CompassNear, AllAroundItFindsTheGlobalMaximum) {
  Random random(12);
  for (int trial = 0; trial < 60; ++trial) {
    const auto [query, reference] = unrelated_views(random);
    const auto global = compass(query, reference);
    ASSERT_TRUE(global);
    for (const double around : {0.0, std::numbers::pi, random.uniform(-10.0, 10.0)}) {
      const auto near = compass_near(query, reference, around, std::numbers::pi);
      ASSERT_TRUE(near);
      EXPECT_NEAR(near->correlation, global->correlation, 1e-9) << "trial " << trial;
      EXPECT_GE(near->heading_rad, -std::numbers::pi);
      EXPECT_LT(near->heading_rad, std::numbers::pi);
      EXPECT_EQ(near->distinctness, 1.0);
    }
  }
}

TEST(CompassNear, AroundTheGlobalMaximumItFindsThat) {
  Random random(13);
  for (int trial = 0; trial < 60; ++trial) {
    const auto [query, reference] = unrelated_views(random);
    const auto global = compass(query, reference);
    ASSERT_TRUE(global);
    for (const double within : {0.01, 0.1, 0.5}) {
      const double around = global->heading_rad + random.uniform(-0.9, 0.9) * within;
      const auto near = compass_near(query, reference, around, within);
      ASSERT_TRUE(near);
      EXPECT_NEAR(near->correlation, global->correlation, 1e-9)
          << "trial " << trial << " within " << within;
      EXPECT_LT(heading_error(*near, global->heading_rad), 1e-5);
    }
  }
}

TEST(CompassNear, ElsewhereItFindsTheBestWithinTheWindow) {
  Random random(14);
  int at_the_edge = 0;
  int inside = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const auto [query, reference] = unrelated_views(random);
    const auto global = compass(query, reference);
    ASSERT_TRUE(global);
    const double within = random.uniform(0.02, 2.0);
    const double away = random.uniform(within + 0.01, 2.0 * std::numbers::pi - within - 0.01);
    const double around = global->heading_rad + away;
    const auto near = compass_near(query, reference, around, within);
    ASSERT_TRUE(near);
    const double off = std::abs(angle_difference(near->heading_rad, around));
    EXPECT_LE(off, within + 1e-9) << "trial " << trial;
    const PackedOracle oracle(query, reference);
    EXPECT_GE(near->correlation, oracle.best_within(around, within) - packed_rounding)
        << "trial " << trial << " around " << around << " within " << within;
    EXPECT_NEAR(near->correlation, oracle.at(near->heading_rad), packed_rounding);
    EXPECT_LE(near->correlation, global->correlation + 1e-9);
    ++(off > within - 1e-9 ? at_the_edge : inside);
  }
  EXPECT_GT(at_the_edge, 10);
  EXPECT_GT(inside, 10);
}

TEST(CompassNear, RefusesWindowsAndHasNoAnswerWithoutStructure) {
  Random random(15);
  const PackedSignature view = pack(random_signature(random, {3, 15}), 1.0F);
  for (const double within :
       {0.0, -0.1, std::numbers::pi + 1e-9, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(static_cast<void>(compass_near(view, view, 0.0, within)), ContractError) << within;
  }
  EXPECT_THROW(static_cast<void>(compass_near(view, view, 0.0, 1.0, 16)), ContractError);
  const PackedSignature flat =
      pack(compute_signature(Panorama(3, 512, std::nullopt, std::vector<float>(3 * 512, 0.7F)), 15),
           1.0F);
  EXPECT_TRUE(compass_near(view, view, 0.0, 1.0));
  EXPECT_FALSE(compass_near(flat, view, 0.0, 1.0));
  EXPECT_FALSE(compass_near(view, flat, 0.0, 1.0));
  EXPECT_FALSE(compass_near(flat, flat, 0.0, 1.0));
}

TEST(Compass, UsesTheComponentsAskedFor) {
  Random random(10);
  const FourierSignature query = random_signature(random, {4, 15});
  const FourierSignature reference = random_signature(random, {4, 15});
  const auto cut = [](const FourierSignature& full, int components) {
    const auto count = static_cast<std::size_t>(components) * full.rows();
    return FourierSignature(
        {full.rows(), components}, {full.magnitudes().begin(), full.magnitudes().begin() + count},
        {full.phases_rad().begin(), full.phases_rad().begin() + count}, std::nullopt);
  };
  const auto limited = compass(query, reference, 5);
  const auto of_cut = compass(cut(query, 5), cut(reference, 5));
  const auto of_one_cut = compass(cut(query, 5), reference);
  ASSERT_TRUE(limited && of_cut && of_one_cut);
  EXPECT_EQ(limited->heading_rad, of_cut->heading_rad);
  EXPECT_EQ(limited->heading_rad, of_one_cut->heading_rad);
  EXPECT_THROW(static_cast<void>(compass(query, reference, 16)), ContractError);
  EXPECT_THROW(static_cast<void>(compass(query, reference, 1)), ContractError);
  EXPECT_THROW(static_cast<void>(compass(query, reference, -1)), ContractError);
  EXPECT_THROW(static_cast<void>(compass(query, random_signature(random, {5, 15}))), ContractError);
}

}  // namespace
}  // namespace panonav::testing
