#include "panonav/localisation/internal/particle_modes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {
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

}  // namespace
}  // namespace panonav
