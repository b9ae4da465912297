#include "panonav/relative_pose/pair_evidence.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/random_views.hpp"
#include "support/skips.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

constexpr ElevationBand evidence_band{-0.6, 0.6};

HomingView encode_view(const Panorama& panorama) {
  return homing_view(compute_signature(panorama, 16));
}

HomingView view_from(const ToyWorld& world, const Pose2& pose) {
  return encode_view(world.panorama(pose, 24, 256, evidence_band));
}

// Pictures of nothing: white noise, noise smoothed along rows, columns or both, and surroundings of
// the spectrum of rooms.
Panorama picture_of_nothing(int kind, std::uint64_t seed) {
  Random random(seed, static_cast<std::uint64_t>(kind));
  if (kind >= 4)
    return random_surroundings(seed, kind == 4 ? 0.0 : 3.0).panorama({}, 24, 256, evidence_band);
  Panorama panorama = random_panorama(random, 24, 96, evidence_band);
  const int along = kind % 2 == 1 ? 12 : 1;
  const int down = kind >= 2 ? 8 : 1;
  Panorama smooth(24, 96, evidence_band);
  for (int y = 0; y < 24; ++y) {
    for (int c = 0; c < 96; ++c) {
      for (int i = 0; i < along * down; ++i) {
        smooth.at(y, c) += panorama.at(std::min(23, y + i / along), (c + i % along) % 96) /
                           static_cast<float>(along * down);
      }
    }
  }
  return smooth;
}

// Replaces a share of the energy of each frequency by noise.
HomingView add_noise(const HomingView& view, double share, std::uint64_t seed) {
  Random random(seed, 3);
  std::vector<float> cosines;
  std::vector<float> sines;
  for (int k = 0; k < view.components(); ++k) {
    for (int y = 0; y < view.rows(); ++y) {
      const auto size = static_cast<double>(std::hypot(view.a(y, k), view.b(y, k)));
      const double phase_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
      const double kept = std::sqrt(1.0 - share);
      const double added = std::sqrt(share) * size;
      cosines.push_back(static_cast<float>(kept * static_cast<double>(view.a(y, k)) +
                                           (k == 0 ? 0.0 : added * std::cos(phase_rad))));
      sines.push_back(k == 0 ? 0.0F
                             : static_cast<float>(kept * static_cast<double>(view.b(y, k)) +
                                                  added * std::sin(phase_rad)));
    }
  }
  return {view.rows(), view.components(), std::move(cosines), std::move(sines), view.elevations()};
}

TEST(PairEvidence, HoldsTheHomeVectorWithinItsDeviations) {
  const ToyWorld world = random_surroundings(4, 2.0);
  const HomingView home = view_from(world, {0.0, 0.0, 0.4});
  const HomingView current = view_from(world, {0.15, 0.1, 1.5});
  const auto evidence = compute_pair_evidence(home, current);
  ASSERT_TRUE(evidence);
  EXPECT_EQ(evidence->vector.xi, home_vector(home, current).xi);
  const double direction_rad = std::atan2(-0.1, -0.15) - 1.5;
  EXPECT_LT(std::abs(angle_difference(evidence->vector.direction_rad(), direction_rad)),
            2.0 * evidence->direction_deviation_rad);
  EXPECT_LT(std::abs(angle_difference(evidence->vector.heading_rad, 0.4 - 1.5)),
            2.0 * evidence->turn_deviation_rad);
  EXPECT_GT(evidence->probability, 0.9);
}

TEST(PairEvidence, ARoomThatNearlyRepeatsAfterHalfATurnHasASecondTurn) {
  Random random(6);
  std::vector<CylinderWave> waves;
  for (int k = 1; k <= 12; ++k) {
    waves.push_back({k, random.uniform(-2.0, 2.0), (k % 2 == 0 ? 0.3 : 0.1) / k,
                     random.uniform(-std::numbers::pi, std::numbers::pi)});
  }
  const ToyWorld world = waved_cylinder(1.0, std::move(waves));
  const auto evidence =
      compute_pair_evidence(view_from(world, {0.0, 0.0, 0.4}), view_from(world, {0.1, 0.0, 1.5}));
  ASSERT_TRUE(evidence && evidence->second);
  const HomeVector& second = *evidence->second;
  EXPECT_NEAR(angle_difference(evidence->vector.heading_rad, 0.4 - 1.5), 0.0, 0.1);
  EXPECT_NEAR(std::abs(angle_difference(second.heading_rad, evidence->vector.heading_rad)),
              std::numbers::pi, 0.3);
  EXPECT_GT(second.residual, 1.5 * evidence->vector.residual);
  EXPECT_LT(second.residual, 0.7) << "the odd waves have a quarter of the energy, twice counted";
}

TEST(PairEvidence, AWindowAroundAWrongTurnLeavesTheRightOneAsTheSecond) {
  const ToyWorld world = random_surroundings(4, 2.0);
  const HomingView home = view_from(world, {0.0, 0.0, 0.4});
  const HomingView current = view_from(world, {0.15, 0.1, 1.5});
  const double right_rad = home_vector(home, current).heading_rad;
  const HeadingWindow around{static_cast<float>(right_rad), 0.5F};
  const auto evidence = compute_pair_evidence(home, current, {}, around);
  ASSERT_TRUE(evidence);
  EXPECT_NEAR(angle_difference(evidence->vector.heading_rad, right_rad), 0.0, 1e-3);
  const HeadingWindow wrong{static_cast<float>(wrap_angle(right_rad + std::numbers::pi)), 1.0F};
  if (const auto limited = compute_pair_evidence(home, current, {}, wrong)) {
    ASSERT_TRUE(limited->second);
    EXPECT_LT(limited->second->residual, limited->vector.residual);
  }
  EXPECT_THROW((void)compute_pair_evidence(home, current, {}, HeadingWindow{0.0F, 4.0F}),
               ContractError);
}

TEST(PairEvidence, PicturesOfNothingGiveNone) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  int known = 0;
  int pointing = 0;
  constexpr int pairs = 30;
  for (int kind = 0; kind < 6; ++kind) {
    for (std::uint64_t pair = 0; pair < pairs; ++pair) {
      const HomingView a = encode_view(picture_of_nothing(kind, 2 * pair + 100));
      const HomingView b = encode_view(picture_of_nothing(kind, 2 * pair + 101));
      known += compute_pair_evidence(a, b) ? 1 : 0;
      pointing += home_vector(a, b).has_direction() ? 1 : 0;
    }
  }
  EXPECT_LE(known, 4) << "2 % of 180 pairs";
  EXPECT_GE(pointing, 90) << "or they are no trap for a direction";
  EXPECT_FALSE(compute_pair_evidence(encode_view(Panorama(4, 64, evidence_band)),
                                     encode_view(Panorama(4, 64, evidence_band))));
}

TEST(PairEvidence, ViewsOfTwoRoomsGiveNone) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  int known = 0;
  int own = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const ToyWorld room = pillared_room(seed);
    const HomingView home = view_from(room, {0.3, 0.1, 0.0});
    own += compute_pair_evidence(home, view_from(room, {0.1, 0.3, 2.0})) ? 1 : 0;
    known +=
        compute_pair_evidence(home, view_from(pillared_room(seed + 50), {0.1, 0.3, 2.0})) ? 1 : 0;
  }
  EXPECT_LE(known, 1) << "of 30";
  EXPECT_GE(own, 27) << "of 30";
}

TEST(PairEvidence, ViewsOfOnePlaceAreKnownWhicheverWayTheRobotFaces) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  int known = 0;
  int queries = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const ToyWorld around = random_surroundings(seed, 2.0);
    const HomingView home = view_from(around, {});
    for (const double far : {0.0, 0.1, 0.2}) {
      const double towards = static_cast<double>(seed);
      const HomingView here = view_from(
          around, {far * std::cos(towards), far * std::sin(towards), wrap_angle(2.0 * towards)});
      const PairFeatures features = compute_pair_features(home, here);
      known += features.is_related() ? 1 : 0;
      ++queries;
      const PairFeatures turned = compute_pair_features(rotate(home, 1.0), rotate(here, -2.0));
      EXPECT_NEAR(turned.deviations_over_noise, features.deviations_over_noise, 1.0);
      EXPECT_NEAR(turned.magnitude_difference, features.magnitude_difference, 1e-3);
      if (far > 0.0) {
        EXPECT_NEAR(turned.direction_probability(), features.direction_probability(), 0.2);
      }
    }
  }
  EXPECT_GE(10 * known, 8 * queries);
}

TEST(PairEvidence, TheProbabilityFallsWithNoise) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  std::vector<double> means;
  for (const double share : {0.0, 0.3, 0.6, 0.9}) {
    double sum = 0.0;
    constexpr int rooms = 10;
    for (std::uint64_t seed = 1; seed <= rooms; ++seed) {
      const ToyWorld around = random_surroundings(seed, 2.0);
      const PairFeatures features = compute_pair_features(
          view_from(around, {}), add_noise(view_from(around, {0.15, 0.1, 1.0}), share, seed));
      const double probability = features.direction_probability();
      EXPECT_TRUE(probability >= 0.0 && probability <= 1.0);
      sum += probability / rooms;
    }
    means.push_back(sum);
  }
  EXPECT_TRUE(std::ranges::is_sorted(means, std::greater<>()));
  EXPECT_GT(means.front(), 0.9);
  EXPECT_LT(means.back(), 0.6);
}

}  // namespace
}  // namespace panonav::testing
