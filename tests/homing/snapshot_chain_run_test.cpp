// Recording a chain and following it in a round room, without a simulator.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/homing/chain_follower.hpp"
#include "panonav/homing/chain_recorder.hpp"
#include "panonav/motion/odometry.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
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

SnapshotChain record(const ToyWorld& world, const std::vector<Pose2>& route,
                     const ChainRecorderOptions& options) {
  ChainRecorder recorder(options);
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
  const SnapshotChain chain = record(world, route, {.longest_spacing_m = 1.0});
  ASSERT_NO_THROW(validate(chain));
  ASSERT_GE(chain.snapshots.size(), 5U);
  EXPECT_EQ(chain.snapshots.front().view, seen_from(world, route.front()));
  EXPECT_EQ(chain.snapshots.back().view, seen_from(world, route.back()));
  EXPECT_NEAR(chain_length_m(chain), 4.2, 0.01);
  Pose2 pose = route.front();
  for (std::size_t i = 1; i < chain.snapshots.size(); ++i) {
    pose = pose * chain.snapshots[i].previous_from_this;
    const double way_m = chain.snapshots[i].travelled_m - chain.snapshots[i - 1].travelled_m;
    EXPECT_LE(way_m, 1.0 + 1e-9);
    const auto number = static_cast<std::size_t>(std::lround(chain.snapshots[i].travelled_m / 0.1));
    ASSERT_LT(number, route.size());
    EXPECT_LT(distance(pose.position(), route[number].position()), 1e-6) << "snapshot " << i;
    EXPECT_EQ(chain.snapshots[i].view, seen_from(world, route[number]));
  }
}

TEST(ChainRecorder, TakesMoreSnapshotsWhereViewsChangeFaster) {
  // The same way in a small and in a large room.
  std::vector<Pose2> straight;
  for (int i = 0; i <= 30; ++i) straight.push_back({-1.5 + 0.1 * i, 0.2, 0.0});
  std::size_t small = 0;
  std::size_t large = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    small += record(striped_round_room(1.8, seed), straight, {}).snapshots.size();
    large += record(striped_round_room(18.0, seed), straight, {}).snapshots.size();
  }
  EXPECT_GT(small, large);
}

TEST(ChainRecorder, ChecksItsInputs) {
  EXPECT_THROW(ChainRecorder({.margin = 0.0}), OptionError);
  EXPECT_THROW(ChainRecorder({.longest_spacing_m = -1.0}), OptionError);
  const ToyWorld world = striped_round_room(3.0, 1);
  ChainRecorder recorder;
  EXPECT_TRUE(recorder.finish().snapshots.empty());
  recorder.add(seen_from(world, {}), {});
  EXPECT_EQ(recorder.finish().snapshots.size(), 1U);
  EXPECT_THROW(recorder.add(seen_from(world, {}, 9), {}), ContractError) << "components";
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(recorder.add(seen_from(world, {}), {nan, 0.0, 0.0}), ContractError);
}

TEST(ChainFollower, DrivesTheRouteAgainInBothDirectionsWhateverTheHeading) {
  const auto route = bend();
  int finished = 0;
  int runs = 0;
  double worst_m = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const ToyWorld world = striped_round_room(6.0, seed);
    const SnapshotChain chain = record(world, route, {.longest_spacing_m = 1.0});
    for (const ChainDirection direction : {ChainDirection::forward, ChainDirection::back}) {
      const bool forward = direction == ChainDirection::forward;
      const Pose2& end = forward ? route.back() : route.front();
      Pose2 pose = forward ? route.front() : route.back();
      pose.heading_rad = wrap_angle(static_cast<double>(seed) * 1.3);
      ChainFollower follower(chain, direction, {}, {.typical_distance_m = 6.0});
      Pose2 moved;
      ++runs;
      for (int step = 0; step < 120; ++step) {
        const ChainDecision decision = follower.decide(seen_from(world, pose), moved);
        if (decision.state == ChainState::finished) {
          EXPECT_EQ(decision.target, forward ? chain.snapshots.size() - 1 : 0U);
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
  const SnapshotChain chain = record(world, bend(), {.longest_spacing_m = 1.0});
  ChainFollower follower(chain, ChainDirection::forward, {}, {.arrived_difference = 0.02});
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
  const SnapshotChain one{{{seen_from(world, {}), 0.0, {}}}};
  EXPECT_THROW(ChainFollower(one, ChainDirection::forward, {.switch_length = -1.0}), OptionError);
  ChainFollower follower(one, ChainDirection::back);
  EXPECT_EQ(follower.decide(seen_from(world, {}), {}).state, ChainState::finished);
}

}  // namespace
}  // namespace panonav::testing
