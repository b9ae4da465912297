// Recording a chain of snapshots and following it in a simulated scene.

#include "lab/s06/chains.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/motion/path.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/simulated_robot.hpp"
#include "support/skips.hpp"

namespace panonav::lab {
using namespace testing;
namespace {

TEST(ChainRun, DistanceFromARouteIsThatFromItsNearestPiece) {
  const std::vector<Pose2> route{{0.0, 0.0, 0.0}, {2.0, 0.0, 0.0}, {2.0, 2.0, 0.0}};
  EXPECT_DOUBLE_EQ(simulation::distance_from_route_m({1.0, 0.5}, route), 0.5);
  EXPECT_DOUBLE_EQ(simulation::distance_from_route_m({-3.0, 4.0}, route), 5.0);
  EXPECT_DOUBLE_EQ(simulation::distance_from_route_m({2.25, 1.0}, route), 0.25);
  EXPECT_EQ(simulation::distance_from_route_m({}, {}), std::numeric_limits<double>::infinity());
}

TEST(DriftingOdometry, StaysWithinItsLimits) {
  const ChainOdometry limits;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const DriftingOdometry odometry(limits, random);
    const Pose2 moved = odometry.measure({1.0, 2.0, 0.5}, Pose2{1.0, 2.0, 0.5} * Pose2{2.0, 0, 0});
    const double off_m = std::hypot(moved.x_m - 2.0, moved.y_m);
    EXPECT_GT(off_m, 0.0);
    EXPECT_LE(off_m, 2.0 * (1.05 * 1.1 - 1.0) + 1e-9);
    EXPECT_LE(std::abs(moved.heading_rad), 2.0 * limits.heading_error_rad_per_m + 1e-9);
  }
}

// Odometry is off by up to 5 % and 2 degrees a metre, and a drift of 10 % is not measured.
TEST(ChainRun, RoutesOfFiftyMetresAreDrivenAgainInBothDirections) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor executor(2);
  const HomingPlace place =
      make_homing_place(simulation::make_scene("loop"), chain_camera(), executor);
  const simulation::FreeSpace& space = *place.free_space;
  EXPECT_THROW((void)plan_random_routes(space, 1, 0.0, 0.1, 1), ContractError);
  EXPECT_THROW((void)plan_random_routes(space, 1, 5.0, 0.0, 1), ContractError);
  const auto routes = plan_random_routes(space, 3, 50.0, 0.1, 5);
  ASSERT_EQ(routes.size(), 3U);
  int completed = 0;
  for (std::size_t r = 0; r < routes.size(); ++r) {
    for (const Pose2& pose : routes[r]) ASSERT_TRUE(space.is_free(pose.position()));
    EXPECT_GE(path_length_m(routes[r]), 49.0);
    const SnapshotChain chain = record_chain(place, routes[r], {}, r);
    EXPECT_LT(chain.bytes_per_100_m(), 2000.0);
    EXPECT_EQ(SnapshotChain::unpack(chain.pack()), chain);
    for (const auto direction : {ChainDirection::forward, ChainDirection::back}) {
      const ChainRun run = follow_chain(place, chain, routes[r], direction, r);
      completed += run.has_completed(0.2);
      EXPECT_FALSE(run.has_arrived_elsewhere(0.5));
      ASSERT_EQ(run.path.size(), run.lateral_m.size());
      for (const Pose2& pose : run.path) EXPECT_TRUE(space.is_free(pose.position()));
      if (r > 0) continue;
      EXPECT_EQ(run.path, follow_chain(place, chain, routes[r], direction, r).path)
          << "the same seed";
    }
  }
  EXPECT_GE(completed, 5);
}

}  // namespace
}  // namespace panonav::lab
