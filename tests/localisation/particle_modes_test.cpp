#include "panonav/localisation/internal/particle_modes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/monte_carlo.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

void add_cloud(const Pose2& centre, double deviation_m, double deviation_rad, std::size_t count,
               double weight, Random& random, Particles& particles) {
  for (std::size_t i = 0; i < count; ++i) {
    particles.add({random.normal(centre.x_m, deviation_m), random.normal(centre.y_m, deviation_m),
                   wrap_angle(random.normal(centre.heading_rad, deviation_rad))},
                  weight / static_cast<double>(count));
  }
}

TEST(FindModes, TellsCloudsApartWithTheirMoments) {
  Random random(1);
  // The heavier one lies across the cut of the circle.
  Particles particles;
  add_cloud({3.0, -2.0, std::numbers::pi}, 0.05, 0.04, 4000, 0.7, random, particles);
  add_cloud({7.0, 1.0, 0.5}, 0.08, 0.1, 2000, 0.3, random, particles);
  const ParticleModes found = find_modes(particles, {.cell_m = 0.25, .headings = 24});
  ASSERT_EQ(found.modes.size(), 2U);
  EXPECT_NEAR(found.modes[0].weight, 0.7, 0.01);
  EXPECT_NEAR(found.modes[1].weight, 0.3, 0.01);
  EXPECT_NEAR(found.modes[0].mean.x_m, 3.0, 0.005);
  EXPECT_NEAR(found.modes[0].mean.y_m, -2.0, 0.005);
  EXPECT_NEAR(angle_difference(found.modes[0].mean.heading_rad, std::numbers::pi), 0.0, 0.005);
  EXPECT_NEAR(found.modes[0].spread_m, 0.05 * std::numbers::sqrt2, 0.005);
  EXPECT_NEAR(found.modes[0].heading_spread_rad, 0.04, 0.004);
  EXPECT_NEAR(found.modes[1].covariance[0], 0.0064, 0.0006);
  EXPECT_NEAR(found.modes[1].covariance[4], 0.0064, 0.0006);
  EXPECT_NEAR(found.modes[1].covariance[8], 0.01, 0.001);
  EXPECT_NEAR(found.modes[1].covariance[1], 0.0, 0.0005);
  ASSERT_EQ(found.mode_of.size(), particles.size());
  EXPECT_EQ(found.mode_of.front(), 0);
  EXPECT_EQ(found.mode_of.back(), 1);
}

TEST(FindModes, OppositeHeadingsAtOnePlaceAreTwoModesUnlessHeadingsDoNotCount) {
  Random random(2);
  Particles particles;
  add_cloud({0.0, 0.0, 0.0}, 0.05, 0.05, 500, 0.5, random, particles);
  add_cloud({0.0, 0.0, 3.0}, 0.05, 0.05, 500, 0.5, random, particles);
  EXPECT_EQ(find_modes(particles, {.cell_m = 0.25, .headings = 24}).modes.size(), 2U);
  EXPECT_EQ(find_modes(particles, {.cell_m = 0.25, .headings = 1}).modes.size(), 1U);
}

TEST(FindModes, TheCovarianceOfAStretchedCloudShowsItsDirection) {
  Random random(3);
  Particles particles;
  for (int i = 0; i < 5000; ++i) {
    const double along = 0.2 * random.normal();
    particles.add({along, 0.5 * along, 0.0}, 1.0);
  }
  const ParticleModes found = find_modes(particles, {.cell_m = 0.5, .headings = 24});
  ASSERT_GE(found.modes.size(), 1U);
  const auto& c = found.modes[0].covariance;
  EXPECT_NEAR(c[1] / c[0], 0.5, 1e-9);
  EXPECT_EQ(c[1], c[3]);
}

TEST(FindModes, LightModesAreNotKeptAndOccupiedBinsCountWeight) {
  Random random(4);
  Particles particles;
  add_cloud({0.0, 0.0, 0.0}, 0.01, 0.01, 100, 0.995, random, particles);
  particles.add({5.0, 5.0, 0.0}, 0.005);
  const ParticleModes found = find_modes(particles, {.cell_m = 1.0, .headings = 24}, 0.01);
  EXPECT_EQ(found.modes.size(), 1U);
  EXPECT_EQ(found.mode_of.back(), -1);
  EXPECT_GE(found.occupied_bins, 2U);
}

TEST(FindModes, NothingAndNoWeightGiveNoMode) {
  EXPECT_TRUE(find_modes({}, {}).modes.empty());
  Particles weightless;
  weightless.resize(3);
  EXPECT_TRUE(find_modes(weightless, {}).modes.empty());
  EXPECT_EQ(position_spread_m({}), 0.0);
  EXPECT_THROW((void)find_modes({}, {.cell_m = 0.0}), ContractError);
  EXPECT_THROW((void)find_modes({}, {.headings = 0}), ContractError);
}

TEST(SpreadOf, IsTheRootMeanSquareDistanceFromTheMean) {
  const Particles four{.x_m = {0.0, 2.0, 0.0, 2.0},
                       .y_m = {0.0, 0.0, 2.0, 2.0},
                       .heading_rad = {0.0, 0.0, 0.0, 0.0},
                       .weight = {0.25, 0.25, 0.25, 0.25}};
  EXPECT_NEAR(position_spread_m(four), std::numbers::sqrt2, 1e-12);
}

TEST(MonteCarlo, ARobotThatStandsStillDoesNotBecomeSurer) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  // Two rooms whose views are equal: both stay possible however often the robot looks.
  const Room room(79, {});
  std::vector<FourierSignature> signatures;
  std::vector<std::optional<ReferencePose>> poses;
  std::uint64_t noise = 1;
  for (const double offset : {0.0, 20.0}) {
    for (const Point2 p : room.grid(0.4)) {
      signatures.push_back(
          compute_signature(room.see({p.x_m, p.y_m, 0.0}, 16, 96, {1.0, 0.01}, ++noise)));
      poses.push_back(ReferencePose{p.x_m + offset, p.y_m, 0.0});
    }
  }
  const VisualMemory memory = make_memory(signatures, poses);
  const auto ranking = std::make_shared<const ColumnRanking>(memory);
  const ObservationModel model = learn_observation_model(*ranking);
  const Point2 here = room.grid(0.4)[7];
  int kept = 0;
  constexpr int runs = 10;
  for (int seed = 1; seed <= runs; ++seed) {
    MonteCarloLocaliser filter(ranking, model, {.seed = seed});
    MonteCarloEstimate found;
    for (int image = 0; image < 20; ++image) {
      if (image > 0) filter.move({});
      found = filter.observe(pack(compute_signature(room.see({here.x_m + 0.1, here.y_m, 0.3}, 16,
                                                             96, {1.0, 0.01}, ++noise)),
                                  memory.full_scale()));
    }
    EXPECT_NE(found.state, LocalisationState::localised);
    bool first = false;
    bool second = false;
    for (const PoseMode& mode : found.modes) {
      first |= distance(mode.mean.position(), {here.x_m + 0.1, here.y_m}) < 0.4;
      second |= distance(mode.mean.position(), {here.x_m + 20.1, here.y_m}) < 0.4;
    }
    kept += first && second ? 1 : 0;
  }
  EXPECT_GE(kept, runs - 1);
}

}  // namespace
}  // namespace panonav::testing
