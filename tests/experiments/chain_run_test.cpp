// A robot that records a chain of snapshots in a simulated room and drives it again.

#include "experiments/runs/chain_run.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/simulation/scenes.hpp"
#include "support/skips.hpp"

namespace panonav {
namespace {

HomingPlace place_of(const char* scene) {
  HomingCamera camera;
  camera.rendering = {.rows = 12, .columns = 128, .rays_per_axis = 1};
  camera.components = 14;
  Executor executor(2);
  return make_homing_place(make_scene(scene), camera, executor);
}

TEST(ChainRun, DistanceFromARouteIsThatFromItsNearestPiece) {
  const std::vector<Pose2> route{{0.0, 0.0, 0.0}, {2.0, 0.0, 0.0}, {2.0, 2.0, 0.0}};
  EXPECT_DOUBLE_EQ(distance_from_route_m({1.0, 0.5}, route), 0.5);
  EXPECT_DOUBLE_EQ(distance_from_route_m({-3.0, 4.0}, route), 5.0);
  EXPECT_DOUBLE_EQ(distance_from_route_m({2.25, 1.0}, route), 0.25);
  EXPECT_EQ(distance_from_route_m({}, {}), std::numeric_limits<double>::infinity());
}

TEST(ChainRun, ARouteOfTwentyMetresIsDrivenAgainInBothDirections) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const HomingPlace place = place_of("loop");
  Executor executor(2);
  const auto routes = random_routes(*place.free_space, 3, 20.0, 0.1, 5);
  ASSERT_EQ(routes.size(), 3U);
  int completed = 0;
  for (std::size_t r = 0; r < routes.size(); ++r) {
    for (const Pose2& pose : routes[r]) ASSERT_TRUE(place.free_space->is_free(pose.position()));
    EXPECT_GE(path_length_m(routes[r]), 19.0);
    const SnapshotChain chain = record_chain(place, routes[r], {}, {}, {}, r);
    EXPECT_NO_THROW(validate(chain));
    EXPECT_LT(chain.snapshots.size(), routes[r].size() / 2);
    for (const auto direction : {ChainDirection::forward, ChainDirection::back}) {
      const bool forward = direction == ChainDirection::forward;
      const ChainRun run =
          follow_chain(place, chain, routes[r], forward ? routes[r].front() : routes[r].back(),
                       {.direction = direction}, r);
      completed += run.completes(0.2);
      ASSERT_EQ(run.path.size(), run.lateral_m.size());
      for (std::size_t i = 0; i < run.path.size(); ++i) {
        EXPECT_TRUE(place.free_space->is_free(run.path[i].position()));
      }
      const ChainRun again =
          follow_chain(place, chain, routes[r], forward ? routes[r].front() : routes[r].back(),
                       {.direction = direction}, r);
      EXPECT_EQ(run.path, again.path) << "the same seed";
    }
  }
  EXPECT_GE(completed, 5);
}

TEST(ChainRun, ChecksItsInputs) {
  const HomingPlace place = place_of("office");
  EXPECT_THROW((void)record_chain(place, {}, {}, {}, {}, 1), ContractError);
  EXPECT_THROW((void)random_routes(*place.free_space, 1, 0.0, 0.1, 1), ContractError);
  EXPECT_THROW((void)random_routes(*place.free_space, 1, 5.0, 0.0, 1), ContractError);
}

}  // namespace
}  // namespace panonav
