// Chains of snapshots: the packed form, recording, and following by an odometry with errors, in a
// round room without a simulator.

#include "panonav/route/snapshot_chain.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/route/chain_follower.hpp"
#include "panonav/route/chain_recorder.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

constexpr SnapshotShape chain_shape{.rows = 1, .components = 12, .bits = 6};

HomingView chain_view(const ToyWorld& world, const Pose2& pose) {
  return homing_view(striped_signature(world, pose, 14));
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

SnapshotChain record_chain(const ToyWorld& world, const std::vector<Pose2>& route,
                           const ChainSpacing& spacing = {.max_spacing_m = 1.5}) {
  ChainRecorder recorder(chain_shape, spacing);
  std::size_t snapshots = 0;
  for (std::size_t i = 0; i < route.size(); ++i) {
    const Pose2 moved = i == 0 ? Pose2{} : inverse(route[i - 1]) * route[i];
    const std::size_t now = recorder.add(chain_view(world, route[i]), moved);
    EXPECT_GE(now, snapshots);
    EXPECT_LE(now, snapshots + 1);
    snapshots = now;
  }
  return recorder.finish();
}

TEST(SnapshotChain, PacksAndUnpacksToTheBit) {
  const SnapshotChain chain = record_chain(striped_round_room(6.0, 1), bend());
  ASSERT_GE(chain.snapshots(), 3U);
  const auto bytes = chain.pack();
  // A header, snapshots, and three bytes for each leg.
  EXPECT_EQ(bytes.size(),
            23 + chain.snapshots() * chain_shape.bytes() + 3 * (chain.nodes().size() - 1));
  EXPECT_NEAR(chain.bytes_per_100_m(), 100.0 * static_cast<double>(bytes.size()) / chain.length_m(),
              1e-9);
  const SnapshotChain unpacked = SnapshotChain::unpack(bytes);
  EXPECT_EQ(unpacked, chain);
  EXPECT_EQ(unpacked.pack(), bytes);
}

TEST(SnapshotChain, HoldsElevationsAsItsPackedFormDoes) {
  const ElevationBand band{radians(-30.0), radians(40.0)};
  SnapshotChain chain({}, band);
  chain.append({}, HomingView(8, 6, std::vector<float>(48), std::vector<float>(48), band));
  ASSERT_TRUE(chain.elevations().has_value());
  constexpr double half_step_rad = 0.5 * ChainHeader::elevation_step_rad + 1e-7;
  EXPECT_NEAR(chain.elevations()->bottom_rad, band.bottom_rad, half_step_rad);
  EXPECT_NEAR(chain.elevations()->top_rad, band.top_rad, half_step_rad);
  EXPECT_EQ(SnapshotChain::unpack(chain.pack()), chain);
  const ElevationBand sphere{-std::numbers::pi / 2.0, std::numbers::pi / 2.0};
  const auto held = SnapshotChain({}, sphere).elevations();
  ASSERT_TRUE(held.has_value());
  EXPECT_NEAR(held->bottom_rad, sphere.bottom_rad, 1e-7);
  EXPECT_NEAR(held->top_rad, sphere.top_rad, 1e-7);
}

TEST(SnapshotChain, HoldsTheErrorsOfOdometryToHalfAPercent) {
  const ChainOdometry odometry{.distance_error = 0.03, .heading_error_rad_per_m = 0.01, .drift = 0};
  SnapshotChain chain({}, std::nullopt, odometry);
  chain.append({}, HomingView(8, 6, std::vector<float>(48), std::vector<float>(48)));
  EXPECT_NEAR(chain.odometry().distance_error, 0.03, 0.004 * 0.03);
  EXPECT_NEAR(chain.odometry().heading_error_rad_per_m, 0.01, 0.004 * 0.01);
  EXPECT_EQ(chain.odometry().drift, 0.0);
  EXPECT_EQ(SnapshotChain::unpack(chain.pack()), chain);
  EXPECT_THROW(SnapshotChain({}, std::nullopt, {.drift = 1.5}), OptionError);
}

TEST(SnapshotChain, EndsOfARouteAreFine) {
  const ToyWorld world = striped_round_room(6.0, 1);
  const auto route = bend();
  constexpr SnapshotShape coarse{.rows = 1, .components = 12, .bits = 4};
  ChainRecorder recorder(coarse, {.max_spacing_m = 1.5});
  // The chain must end well wherever the recording stops.
  for (std::size_t i = 0; i < route.size(); ++i) {
    recorder.add(chain_view(world, route[i]), i == 0 ? Pose2{} : inverse(route[i - 1]) * route[i]);
    const SnapshotChain chain = recorder.finish();
    const auto nodes = chain.nodes();
    std::size_t bytes = ChainHeader::bytes;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      EXPECT_EQ(nodes[n].is_fine, n == 0 || n + 1 == nodes.size()) << i;
      bytes += nodes[n].snapshot.size() + (n > 0 ? ChainLeg::bytes : 0);
      if (nodes[n].is_fine) EXPECT_EQ(nodes[n].snapshot.size(), make_fine(coarse).bytes());
    }
    const auto packed = chain.pack();
    EXPECT_EQ(packed.size(), bytes);
    EXPECT_EQ(SnapshotChain::unpack(packed), chain);
    std::vector<ChainStop> stops(nodes.size());
    const auto read = read_chain(packed, stops);
    ASSERT_TRUE(read.has_value());
    EXPECT_TRUE(read->stops.back().is_fine);
  }
}

TEST(SnapshotChain, RoundingErrorsOfLegsDoNotAddUp) {
  SnapshotChain chain;
  const HomingView view(8, 6, std::vector<float>(48), std::vector<float>(48));
  Random random(4);
  Point2 place;
  chain.append(place, view);
  for (int i = 0; i < 200; ++i) {
    place.x_m += random.uniform(-1.0, 5.0);
    place.y_m += random.uniform(-4.0, 4.0);
    chain.append(place, i % 3 == 0 ? std::optional(view) : std::nullopt);
    // Half a centimetre along the leg, and half of 2 pi / 2048 of at most 6.5 m across.
    EXPECT_LT(distance(chain.nodes().back().position, place), 0.0113);
  }
  chain.append(place, view);
  EXPECT_EQ(SnapshotChain::unpack(chain.pack()), chain);
  EXPECT_THROW(chain.append({place.x_m + 20.5, place.y_m}, view), ContractError);
}

TEST(SnapshotChain, RefusesBytesThatAreNotWritten) {
  const auto bytes = record_chain(striped_round_room(6.0, 1), bend()).pack();
  EXPECT_NO_THROW((void)SnapshotChain::unpack(bytes));
  const auto expect_refused = [&](std::size_t index, std::uint8_t value) {
    auto changed = bytes;
    changed[index] = value;
    EXPECT_THROW((void)SnapshotChain::unpack(changed), ContractError) << "byte " << index;
  };
  expect_refused(0, 0);      // magic number
  expect_refused(2, 0);      // rows
  expect_refused(3, 1);      // components
  expect_refused(4, 9);      // bits
  expect_refused(10, 0xBF);  // typical distance: negative
  expect_refused(12, 0x7F);  // reach
  expect_refused(14, 0x7F);  // arrived difference
  expect_refused(16, 0x7F);  // homing confidence
  expect_refused(18, 0x7F);  // errors of distances
  expect_refused(20, 0x7F);  // errors of the heading
  expect_refused(22, 0x7F);  // drift
  expect_refused(23, 0);     // a snapshot without scale
  expect_refused(23 + chain_shape.bytes(), bytes[23 + chain_shape.bytes()] | 3U);  // kind of a node
  const std::vector<std::size_t> sizes{0, 22, 23, 23 + chain_shape.bytes() + 2, bytes.size() - 1};
  for (const std::size_t size : sizes) {
    EXPECT_THROW((void)SnapshotChain::unpack(std::span(bytes).first(size)), ContractError) << size;
  }
  // A chain ends with a snapshot.
  SnapshotChain chain;
  const HomingView view(8, 6, std::vector<float>(48), std::vector<float>(48));
  EXPECT_THROW((void)chain.pack(), ContractError);
  EXPECT_THROW(chain.append({}, std::nullopt), ContractError);
  chain.append({}, view);
  chain.append({1.0, 0.0}, std::nullopt);
  EXPECT_THROW((void)chain.pack(), ContractError);
  EXPECT_THROW((void)chain.view(1), ContractError);
  EXPECT_THROW(chain.set_model({.typical_distance_m = 0.0F}), ContractError);
}

TEST(ChainRecorder, SnapshotsLieOnTheRouteAtTheHeadingOfTheStart) {
  const ToyWorld world = striped_round_room(6.0, 3);
  const auto route = bend();
  const SnapshotChain chain = record_chain(world, route);
  EXPECT_NEAR(chain.length_m(), 4.2, 0.1);
  double previous_m = 0.0;
  for (std::size_t i = 0; i < chain.nodes().size(); ++i) {
    const Point2 place = route.front() * chain.nodes()[i].position;
    double from_route_m = 10.0;
    for (const Pose2& pose : route) {
      from_route_m = std::min(from_route_m, distance(pose.position(), place));
    }
    EXPECT_LT(from_route_m, 0.02) << "node " << i;
    if (!chain.nodes()[i].has_snapshot()) continue;
    const Pose2 from{place.x_m, place.y_m, route.front().heading_rad};
    const HomingView there = reduce_view(chain_view(world, from), 1, 12);
    EXPECT_LT(image_difference(chain.view(i), there), 0.02) << "node " << i;
    EXPECT_NEAR(home_vector(chain.view(i), there).heading_rad, 0.0, 0.03) << "node " << i;
    const double path_m = distance(route.front().position(), place);
    EXPECT_GE(path_m, previous_m);
    previous_m = path_m;
  }
}

TEST(ChainRecorder, TakesMoreSnapshotsWhereViewsChangeFasterAndFewerForABudget) {
  std::vector<Pose2> straight;
  for (int i = 0; i <= 30; ++i) straight.push_back({-1.5 + 0.1 * i, 0.2, 0.0});
  std::size_t small = 0;
  std::size_t large = 0;
  std::size_t cheap = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    small += record_chain(striped_round_room(1.8, seed), straight, {}).snapshots();
    large += record_chain(striped_round_room(18.0, seed), straight, {}).snapshots();
    cheap += record_chain(striped_round_room(1.8, seed), straight, {.bytes_per_100_m = 1000.0})
                 .snapshots();
  }
  EXPECT_GT(small, large);
  EXPECT_GT(small, cheap);
}

TEST(ChainRecorder, AViewIsAChain) {
  const ToyWorld world = striped_round_room(3.0, 1);
  ChainRecorder recorder(chain_shape);
  EXPECT_EQ(recorder.finish(), SnapshotChain(chain_shape));
  EXPECT_EQ(recorder.add(chain_view(world, {}), {}), 1U);
  EXPECT_EQ(recorder.finish().snapshots(), 1U);
  EXPECT_THROW(recorder.add(chain_view(world, {}), {std::nan(""), 0.0, 0.0}), ContractError);
  EXPECT_THROW(ChainRecorder({}, {.max_spacing_m = 21.0}), OptionError);
}

struct Drive {
  ChainState state = ChainState::travelling;
  double end_m = 0.0;  // from the last snapshot
  bool has_searched = false;
};

// Drives along the chain by an odometry with constant errors; the robot stays in the room.
Drive drive(const ToyWorld& world, const SnapshotChain& chain, const std::vector<Pose2>& route,
            ChainDirection direction, Pose2 start, double scale, double turn_rad_per_m) {
  const Pose2& end = direction == ChainDirection::forward ? route.back() : route.front();
  ChainFollower follower(chain, direction);
  Drive driven;
  Pose2 moved;
  for (int step = 0; step < 400; ++step) {
    const ChainDecision decision = follower.decide(chain_view(world, start), moved);
    driven.state = decision.state;
    driven.has_searched = driven.has_searched || decision.state == ChainState::searching;
    if (decision.state == ChainState::arrived || decision.state == ChainState::lost) break;
    const Pose2 command = Pose2{0.0, 0.0, decision.turn_rad} * Pose2{decision.advance_m, 0.0, 0.0};
    const Pose2 next = start * command;
    moved = {};
    if (std::hypot(next.x_m, next.y_m) > 5.0) continue;  // a wall
    start = next;
    moved = {scale * command.x_m, scale * command.y_m,
             wrap_angle(command.heading_rad + turn_rad_per_m * decision.advance_m)};
  }
  driven.end_m = distance(start.position(), end.position());
  return driven;
}

TEST(ChainFollower, RepeatsARouteInBothDirectionsWithErrorsOfOdometry) {
  const auto route = bend();
  int arrived = 0;
  int runs = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const ToyWorld world = striped_round_room(6.0, seed);
    const SnapshotChain chain = record_chain(world, route);
    for (const ChainDirection direction : {ChainDirection::forward, ChainDirection::back}) {
      Pose2 start = direction == ChainDirection::forward ? route.front() : route.back();
      start.heading_rad = wrap_angle(static_cast<double>(seed) * 1.3);
      const double sign = seed % 2 == 0 ? 1.0 : -1.0;
      const Drive driven =
          drive(world, chain, route, direction, start, 1.0 + 0.05 * sign, -0.03 * sign);
      ++runs;
      if (driven.state != ChainState::arrived) continue;
      ++arrived;
      EXPECT_LT(driven.end_m, 0.2);
    }
  }
  EXPECT_EQ(runs, 10);
  EXPECT_GE(arrived, 9);
}

TEST(ChainFollower, SearchesForASnapshotThatOdometryHasMissed) {
  const auto route = bend();
  int searched = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const ToyWorld world = striped_round_room(6.0, seed);
    const SnapshotChain chain =
        record_chain(world, route, {.max_spacing_m = 4.0, .bytes_per_100_m = 700.0});
    // The errors are larger than assumed.
    const Drive driven =
        drive(world, chain, route, ChainDirection::forward, route.front(), 0.8, 0.2);
    searched += driven.has_searched ? 1 : 0;
    if (driven.state != ChainState::arrived) continue;
    EXPECT_LT(driven.end_m, 0.5);
  }
  EXPECT_GE(searched, 1);
}

// A view in a room with light from one side: with 1, the darkest azimuth has no light.
HomingView side_lit_view(const ToyWorld& world, const Pose2& pose, double side_light,
                         Random& noise) {
  Panorama panorama = world.panorama(pose, 12, 64, ElevationBand{radians(-25.0), radians(35.0)},
                                     noise, {1.0, 0.01});
  const auto values = panorama.values();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double azimuth_rad = 2.0 * std::numbers::pi * static_cast<double>(i % 64) / 64.0;
    values[i] *= static_cast<float>(1.0 + side_light * std::cos(azimuth_rad + pose.heading_rad));
  }
  return homing_view(compute_signature(preprocess(panorama, {}), 8));
}

// Records a chain through a room and drives along it in light from one side. `end_difference`: of
// the last view and the last snapshot.
Drive drive_in_side_light(std::uint64_t seed, double side_light, double& end_difference) {
  const ToyWorld world = two_rooms(seed, false);
  Random noise(seed);
  ChainRecorder recorder;
  constexpr double step_m = 0.1;
  const Pose2 start{0.7, 0.6, 0.0};
  Pose2 pose = start;
  for (int i = 0; i <= 25; ++i) {
    if (i > 0) pose = pose * Pose2{step_m, 0.0, 0.0};
    recorder.add(side_lit_view(world, pose, 0.0, noise), i == 0 ? Pose2{} : Pose2{step_m, 0, 0});
  }
  const SnapshotChain chain = recorder.finish();
  ChainFollower follower(chain, ChainDirection::forward);
  Drive driven;
  Pose2 moved;
  Pose2 robot = start;
  for (int step = 0; step < 1000; ++step) {
    const HomingView view = side_lit_view(world, robot, side_light, noise);
    const ChainDecision decision = follower.decide(view, moved);
    driven.state = decision.state;
    end_difference =
        image_difference(chain.view(chain.nodes().size() - 1), reduce_view(view, 8, 6));
    if (decision.state == ChainState::arrived || decision.state == ChainState::lost) break;
    moved = Pose2{0.0, 0.0, decision.turn_rad} * Pose2{decision.advance_m, 0.0, 0.0};
    robot = robot * moved;
    moved.x_m *= 1.03;
    moved.y_m *= 1.03;
  }
  driven.end_m = distance(robot.position(), pose.position());
  return driven;
}

TEST(ChainFollower, ArrivesInLightFromOneSideOrSaysThatItIsLost) {
  int arrived = 0;
  int less_similar = 0;
  for (const double side_light : {0.3, 0.9}) {
    for (std::uint64_t seed = 9101; seed <= 9106; ++seed) {
      double end_difference = 0.0;
      const Drive driven = drive_in_side_light(seed, side_light, end_difference);
      if (driven.state != ChainState::arrived) {
        EXPECT_EQ(driven.state, ChainState::lost);
        continue;
      }
      ++arrived;
      EXPECT_LT(driven.end_m, 0.5) << "seed " << seed;
      less_similar += end_difference > static_cast<double>(ChainModel{}.arrived_difference) ? 1 : 0;
    }
  }
  EXPECT_GE(arrived, 3);
  EXPECT_GE(less_similar, 1);
}

TEST(ChainFollower, IsLostInAnotherPlace) {
  const SnapshotChain chain = record_chain(striped_round_room(6.0, 1), bend());
  for (std::uint64_t seed = 50; seed < 60; ++seed) {
    const Drive driven = drive(striped_round_room(6.0, seed), chain, bend(),
                               ChainDirection::forward, {0.0, 0.0, 0.0}, 1.0, 0.0);
    EXPECT_EQ(driven.state, ChainState::lost) << "seed " << seed;
  }
}

TEST(ChainFollower, ChecksItsInputs) {
  EXPECT_THROW(ChainFollower(SnapshotChain{}, ChainDirection::forward), ContractError);
  const ToyWorld world = striped_round_room(3.0, 1);
  ChainRecorder recorder(chain_shape);
  recorder.add(chain_view(world, {}), {});
  EXPECT_THROW(ChainFollower(recorder.finish(), ChainDirection::back, {.max_step_m = 0.0}),
               OptionError);
  ChainFollower follower(recorder.finish(), ChainDirection::back);
  EXPECT_THROW((void)follower.decide(chain_view(world, {}), {0.0, std::nan(""), 0.0}),
               ContractError);
  EXPECT_EQ(follower.decide(chain_view(world, {}), {}).state, ChainState::arrived);
  EXPECT_EQ(follower.decide(chain_view(world, {1.0, 0.0, 0.0}), {}).state, ChainState::arrived);
}

TEST(ChainOdometry, ErrorsGrowWithTheDistance) {
  const ChainOdometry exact{.distance_error = 0.0, .heading_error_rad_per_m = 0.0, .drift = 0.0};
  EXPECT_EQ(exact.position_error_m(10.0), 0.0);
  EXPECT_EQ(exact.heading_error_rad(10.0), 0.0);
  // Both drives: the square root of 2 times 10 % of the distance.
  const ChainOdometry windy{.distance_error = 0.0, .heading_error_rad_per_m = 0.0, .drift = 0.1};
  EXPECT_NEAR(windy.position_error_m(10.0), std::sqrt(2.0), 1e-12);
  EXPECT_GT(ChainOdometry{}.position_error_m(10.0), 2.0 * ChainOdometry{}.position_error_m(5.0));
}

}  // namespace
}  // namespace panonav::testing
