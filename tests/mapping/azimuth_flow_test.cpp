#include "panonav/mapping/internal/azimuth_flow.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

HomingView seen(const ToyWorld& room, const Pose2& pose) {
  return homing_view(round_room_signature(room, pose));
}

TEST(AzimuthFlow, ATurnOnTheSpotIsATurnAndNothingElse) {
  const ToyWorld room = round_room(round_room_radius_m, 1);
  for (const double turn : {-0.2, 0.0, 0.1}) {
    const auto flow =
        refine_flow(seen(room, {0.5, 0.2, 0.3}), seen(room, {0.5, 0.2, 0.3 + turn}), {}, 4);
    EXPECT_NEAR(flow.turn_rad(), turn, 1e-4);
    EXPECT_NEAR(flow.length(), 0.0, 1e-4);
    EXPECT_LT(flow.residual, 1e-6);
  }
}

TEST(AzimuthFlow, TheSecondHarmonicIsTheNearerSide) {
  // v = 0.1 along x, inverse distances 1 + 0.5 cos(phi - phi1): the mean of the shifts is
  // -0.025 sin(phi1), which looks like a turn.
  for (const double phi1 : {-1.5, -0.3, 0.8, 2.9}) {
    const AzimuthFlow flow{.g0 = 0.2 - 0.025 * std::sin(phi1),
                           .b1 = -0.1,
                           .a2 = 0.025 * std::sin(phi1),
                           .b2 = -0.025 * std::cos(phi1)};
    EXPECT_NEAR(flow.direction_rad(), 0.0, 1e-12);
    EXPECT_NEAR(flow.turn_rad(), 0.2, 1e-12);
  }
}

// Along a wall, near it: without the correction every step looks like a turn to the same side.
TEST(AzimuthFlow, AlongAWallTurnsAreRight) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const ToyWorld room = round_room(round_room_radius_m, seed);
    double with = 0.0;
    double without = 0.0;
    constexpr int steps = 20;
    for (int i = 0; i < steps; ++i) {
      const Pose2 before{-1.0 + 0.1 * i, -2.2, 0.0};
      const Pose2 after{before.x_m + 0.1, -2.2, 0.0};
      const OdometryView a(round_room_signature(room, before));
      const OdometryView b(round_room_signature(room, after));
      with += visual_step(a, b).value().before_from_after.heading_rad;
      without += visual_step(a, b, {.nearer_side = false}).value().before_from_after.heading_rad;
    }
    EXPECT_GT(std::abs(without), radians(5.0)) << "guard: nearer things do look like a turn";
    EXPECT_LT(std::abs(with), 0.4 * std::abs(without)) << "seed " << seed;
  }
}

TEST(AzimuthFlow, ViewsWithoutStructureStayWhereTheyStart) {
  const HomingView nothing = homing_view(compute_signature(
      Panorama(round_room_shape.rows, 96, std::nullopt), round_room_shape.components));
  const auto flow = refine_flow(nothing, nothing, {.g0 = 0.1, .b1 = -0.05}, 3);
  EXPECT_NEAR(flow.g0, 0.1, 1e-9);
  EXPECT_NEAR(flow.b1, -0.05, 1e-9);
  EXPECT_EQ(flow.residual, 1.0);
}

}  // namespace
}  // namespace panonav::testing
