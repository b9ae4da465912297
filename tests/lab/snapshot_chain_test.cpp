// Recording a chain of snapshots and following it: in a round room without a simulator, and in a
// simulated scene.

#include "lab/s06/snapshot_chain.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "lab/s06/chains.hpp"
#include "panonav/core/error.hpp"
#include "panonav/motion/path.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/simulated_robot.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::lab {
using namespace testing;
namespace {

HomingView seen_from(const ToyWorld& world, const Pose2& pose, int components = 14) {
  return homing_view(striped_signature(world, pose, components));
}

// A bend of 4.2 m within a room of 6 m radius.
std::vector<Pose2> bend() {
  std::vector<Pose2> poses;
  for (int i = 0; i <= 42; ++i) {
    const double angle = -1.0 + 0.1 * i / 2.0;
    poses.push_back(
        {2.0 * std::cos(angle), 2.0 * std::sin(angle), wrap_angle(angle + std::numbers::pi / 2.0)});
  }
  return poses;
}

SnapshotChain record(const ToyWorld& world, const std::vector<Pose2>& route, double max_spacing_m) {
  ChainRecorder recorder(max_spacing_m);
  std::size_t snapshots = 0;
  for (std::size_t i = 0; i < route.size(); ++i) {
    const Pose2 moved = i == 0 ? Pose2{} : inverse(route[i - 1]) * route[i];
    const std::size_t now = recorder.add(seen_from(world, route[i]), moved);
    EXPECT_GE(now, snapshots);
    EXPECT_LE(now, snapshots + 1);
    snapshots = now;
  }
  return recorder.finish();
}

TEST(ChainRecorder, SnapshotsLieOnTheRouteAndItsEndIsTheLast) {
  const ToyWorld world = striped_round_room(6.0, 3);
  const auto route = bend();
  const SnapshotChain chain = record(world, route, 1.0);
  ASSERT_GE(chain.size(), 5U);
  EXPECT_EQ(chain.front().view, seen_from(world, route.front()));
  EXPECT_EQ(chain.back().view, seen_from(world, route.back()));
  EXPECT_NEAR(chain_length_m(chain), 4.2, 0.01);
  Pose2 pose = route.front();
  for (std::size_t i = 1; i < chain.size(); ++i) {
    pose = pose * chain[i].previous_from_this;
    const double way_m = chain[i].travelled_m - chain[i - 1].travelled_m;
    EXPECT_LE(way_m, 1.0 + 1e-9);
    const auto number = static_cast<std::size_t>(std::lround(chain[i].travelled_m / 0.1));
    ASSERT_LT(number, route.size());
    EXPECT_LT(distance(pose.position(), route[number].position()), 1e-6) << "snapshot " << i;
    EXPECT_EQ(chain[i].view, seen_from(world, route[number]));
  }
}

TEST(ChainRecorder, TakesMoreSnapshotsWhereViewsChangeFaster) {
  // The same way in a small and in a large room.
  std::vector<Pose2> straight;
  for (int i = 0; i <= 30; ++i) straight.push_back({-1.5 + 0.1 * i, 0.2, 0.0});
  std::size_t small = 0;
  std::size_t large = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    small += record(striped_round_room(1.8, seed), straight, 5.0).size();
    large += record(striped_round_room(18.0, seed), straight, 5.0).size();
  }
  EXPECT_GT(small, large);
}

TEST(ChainRecorder, AViewIsAChain) {
  const ToyWorld world = striped_round_room(3.0, 1);
  ChainRecorder recorder;
  EXPECT_TRUE(recorder.finish().empty());
  recorder.add(seen_from(world, {}), {});
  EXPECT_EQ(recorder.finish().size(), 1U);
}

TEST(SnapshotChain, CountsItsBytesPerMetre) {
  // One row, frequencies 1 .. 3, two floats each [S06 section 4.4]; and four floats for the way.
  const HomingView view(1, 4, std::vector<float>(4), std::vector<float>(4));
  const SnapshotChain chain{{view, 1.0, {}}, {view, 3.0, {}}, {view, 5.0, {}}};
  EXPECT_EQ(chain_length_m(chain), 4.0);
  EXPECT_EQ(bytes_per_metre(chain), 3.0 * (24 + 16) / 4.0);
  EXPECT_EQ(bytes_per_metre({chain.front()}), 0.0);
  EXPECT_EQ(chain_length_m({}), 0.0);
}

TEST(ChainFollower, DrivesTheRouteAgainInBothDirectionsWhateverTheHeading) {
  const auto route = bend();
  int finished = 0;
  int runs = 0;
  double worst_m = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const ToyWorld world = striped_round_room(6.0, seed);
    const SnapshotChain chain = record(world, route, 1.0);
    for (const ChainDirection direction : {ChainDirection::forward, ChainDirection::back}) {
      const bool forward = direction == ChainDirection::forward;
      const Pose2& end = forward ? route.back() : route.front();
      Pose2 pose = forward ? route.front() : route.back();
      pose.heading_rad = wrap_angle(static_cast<double>(seed) * 1.3);
      ChainFollower follower(chain, direction, {.typical_distance_m = 6.0});
      Pose2 moved;
      ++runs;
      for (int step = 0; step < 120; ++step) {
        const ChainDecision decision = follower.decide(seen_from(world, pose), moved);
        if (decision.state == ChainState::finished) {
          EXPECT_EQ(decision.target, forward ? chain.size() - 1 : 0U);
          EXPECT_LT(distance(pose.position(), end.position()), 0.1);
          ++finished;
        }
        if (decision.state != ChainState::following) break;
        moved = Pose2{0.0, 0.0, decision.turn_rad} * Pose2{decision.advance_m, 0.0, 0.0};
        pose = pose * moved;
        double from_route_m = 10.0;
        for (const Pose2& place : route) {
          from_route_m = std::min(from_route_m, distance(place.position(), pose.position()));
        }
        worst_m = std::max(worst_m, from_route_m);
      }
    }
  }
  EXPECT_EQ(finished, runs);
  EXPECT_LT(worst_m, 0.5);
}

TEST(ChainFollower, SaysThatItIsLostInAnotherPlace) {
  const ToyWorld world = striped_round_room(6.0, 1);
  const ToyWorld other = striped_round_room(6.0, 50);
  const SnapshotChain chain = record(world, bend(), 1.0);
  ChainFollower follower(chain, ChainDirection::forward, {.arrived_difference = 0.02});
  Pose2 pose{0.0, 0.0, 0.0};
  Pose2 moved;
  ChainState state = ChainState::following;
  for (int step = 0; step < 300 && state == ChainState::following; ++step) {
    const ChainDecision decision = follower.decide(seen_from(other, pose), moved);
    state = decision.state;
    moved = Pose2{0.0, 0.0, decision.turn_rad} * Pose2{decision.advance_m, 0.0, 0.0};
    const Pose2 next = pose * moved;
    // A wall.
    if (std::hypot(next.x_m, next.y_m) < 5.0) pose = next;
  }
  EXPECT_EQ(state, ChainState::lost);
}

TEST(ChainFollower, ChecksItsInputs) {
  EXPECT_THROW(ChainFollower({}, ChainDirection::forward), ContractError) << "an empty chain";
  const ToyWorld world = striped_round_room(3.0, 1);
  ChainFollower follower({{seen_from(world, {}), 0.0, {}}}, ChainDirection::back);
  EXPECT_EQ(follower.decide(seen_from(world, {}), {}).state, ChainState::finished);
}

TEST(ChainRun, DistanceFromARouteIsThatFromItsNearestPiece) {
  const std::vector<Pose2> route{{0.0, 0.0, 0.0}, {2.0, 0.0, 0.0}, {2.0, 2.0, 0.0}};
  EXPECT_DOUBLE_EQ(simulation::distance_from_route_m({1.0, 0.5}, route), 0.5);
  EXPECT_DOUBLE_EQ(simulation::distance_from_route_m({-3.0, 4.0}, route), 5.0);
  EXPECT_DOUBLE_EQ(simulation::distance_from_route_m({2.25, 1.0}, route), 0.25);
  EXPECT_EQ(simulation::distance_from_route_m({}, {}), std::numeric_limits<double>::infinity());
}

TEST(ChainRun, ARouteOfTwentyMetresIsDrivenAgainInBothDirections) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor executor(2);
  const HomingPlace place =
      make_homing_place(simulation::make_scene("loop"), chain_camera(), executor);
  const simulation::FreeSpace& space = *place.free_space;
  EXPECT_THROW((void)plan_random_routes(space, 1, 0.0, 0.1, 1), ContractError);
  EXPECT_THROW((void)plan_random_routes(space, 1, 5.0, 0.0, 1), ContractError);
  const auto routes = plan_random_routes(space, 3, 20.0, 0.1, 5);
  ASSERT_EQ(routes.size(), 3U);
  int completed = 0;
  for (std::size_t r = 0; r < routes.size(); ++r) {
    for (const Pose2& pose : routes[r]) ASSERT_TRUE(space.is_free(pose.position()));
    EXPECT_GE(path_length_m(routes[r]), 19.0);
    const SnapshotChain chain = record_chain(place, routes[r], r);
    EXPECT_LT(chain.size(), routes[r].size() / 2);
    for (const auto direction : {ChainDirection::forward, ChainDirection::back}) {
      const ChainRun run = follow_chain(place, chain, routes[r], direction, r);
      completed += run.has_completed(0.2);
      ASSERT_EQ(run.path.size(), run.lateral_m.size());
      for (const Pose2& pose : run.path) EXPECT_TRUE(space.is_free(pose.position()));
      EXPECT_EQ(run.path, follow_chain(place, chain, routes[r], direction, r).path)
          << "the same seed";
    }
  }
  EXPECT_GE(completed, 5);
}

}  // namespace
}  // namespace panonav::lab
