// Learning the surroundings of a home, and finding home again, in a forest without a simulator.

#include "panonav/route/home_area.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/route/home_finder.hpp"
#include "panonav/signature/fourier_signature.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

constexpr double view_spacing_m = 0.3;

// Trunks on 50 x 50 m before a far background, around a clearing.
ToyWorld forest(std::uint64_t seed) {
  ToyWorld world(seed, 0.1);
  Random random(seed);
  constexpr double clearing_m = 4.0;
  for (int i = 0; i < 60; ++i) {
    const double grey = random.uniform(0.1, 0.9);
    const Point2 place{random.uniform(-25.0, 25.0), random.uniform(-25.0, 25.0)};
    const double radius_m = random.uniform(0.15, 0.7);
    if (distance(place, {}) < clearing_m) continue;
    world.add_pillar(place, radius_m, [grey](double along, double up_m, double) {
      return grey + 0.1 * std::sin(3.0 * along) * std::cos(2.0 * up_m);
    });
  }
  const Texture background(world.random(), 0.2);
  world.add_pillar({}, 50.0, [background](double along, double up_m, double) {
    return background(30.0 * along, up_m);
  });
  return world;
}

HomingView forest_view(const ToyWorld& world, const Pose2& pose) {
  const ElevationBand band{radians(-30.0), radians(40.0)};
  return homing_view(compute_signature(world.panorama(pose, 16, 128, band), 6));
}

// Poses along straight lines between corners, facing along them.
std::vector<Pose2> walk_along(const std::vector<Point2>& corners) {
  std::vector<Pose2> poses;
  double left_m = 0.0;
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const Point2 from = corners[i - 1];
    const double length_m = distance(from, corners[i]);
    const double x = (corners[i].x_m - from.x_m) / length_m;
    const double y = (corners[i].y_m - from.y_m) / length_m;
    for (; left_m < length_m; left_m += view_spacing_m) {
      poses.push_back({from.x_m + left_m * x, from.y_m + left_m * y, std::atan2(y, x)});
    }
    left_m -= length_m;
  }
  return poses;
}

// Four petals around home.
std::vector<Pose2> petals(Point2 home, double radius_m) {
  std::vector<Point2> corners{home};
  for (int petal = 0; petal < 4; ++petal) {
    for (const double part : {0.0, 0.5}) {
      const double angle = (petal + part) * 0.5 * std::numbers::pi;
      corners.push_back(
          {home.x_m + radius_m * std::cos(angle), home.y_m + radius_m * std::sin(angle)});
    }
    corners.push_back(home);
  }
  return walk_along(corners);
}

// Odometry that does not see a wind along y.
Pose2 measure(const Pose2& from, const Pose2& to, double wind) {
  Pose2 step = inverse(from) * to;
  const double length_m = std::hypot(step.x_m, step.y_m);
  const Point2 drift = Pose2{0.0, 0.0, -from.heading_rad} * Point2{0.0, wind * length_m};
  return {step.x_m - drift.x_m, step.y_m - drift.y_m, step.heading_rad};
}

HomeArea learn(const ToyWorld& world, const std::vector<Pose2>& walk, double wind, int threads = 1,
               int max_bytes = 1000) {
  HomeAreaLearner learner({}, {.max_bytes = max_bytes});
  for (std::size_t i = 0; i < walk.size(); ++i) {
    learner.add(forest_view(world, walk[i]),
                i == 0 ? Pose2{} : measure(walk[i - 1], walk[i], wind));
  }
  Executor executor(threads);
  return learner.finish(executor);
}

TEST(HomeAreaLearner, KeepsFewSnapshotsWithinItsBytes) {
  const ToyWorld world = forest(1);
  const std::vector<Pose2> walk = petals({}, 3.0);
  const HomeArea area = learn(world, walk, 0.0);
  EXPECT_LE(area.chain.pack().size(), 1000U);
  EXPECT_GE(area.chain.snapshots(), 4U);
  EXPECT_EQ(area.chain.nodes().front().position, Point2{});
  EXPECT_EQ(SnapshotChain::unpack(area.chain.pack()), area.chain);
  EXPECT_GE(area.homeward_component(), 0.7);
  // More bytes never make the home vectors of its own views worse by more than noise.
  const HomeArea small = learn(world, walk, 0.0, 1, 200);
  EXPECT_LE(small.chain.pack().size(), 200U);
  EXPECT_LT(small.homeward_component(), area.homeward_component());
  EXPECT_EQ(learn(world, walk, 0.0, 3).chain, area.chain) << "any number of threads";
}

TEST(HomeAreaLearner, AConstantWindCancelsBetweenReturns) {
  const ToyWorld world = forest(2);
  const std::vector<Pose2> walk = petals({}, 3.0);
  const HomeArea area = learn(world, walk, 0.1);
  EXPECT_GE(area.returns, 3U);
  ASSERT_FALSE(area.held_out.empty());
  double max_error_m = 0.0;
  for (const HeldOutView& view : area.held_out) {
    const Point2 place = walk.front() * view.pose.position();
    double from_walk_m = 10.0;
    for (const Pose2& pose : walk)
      from_walk_m = std::min(from_walk_m, distance(pose.position(), place));
    max_error_m = std::max(max_error_m, from_walk_m);
  }
  EXPECT_LT(max_error_m, 0.5) << "odometry alone is off by 2.5 m at the end";
}

TEST(HomeAreaLearner, RefusesWhatIsNoWalk) {
  EXPECT_THROW(HomeAreaLearner({}, {.max_bytes = 199}), OptionError);
  EXPECT_THROW(HomeAreaLearner({.rows = 200, .components = 12, .bits = 8}, {.max_bytes = 400}),
               ContractError);
  Executor executor(1);
  HomeAreaLearner learner;
  EXPECT_THROW((void)learner.finish(executor), ContractError);
  const HomingView view(8, 6, std::vector<float>(48), std::vector<float>(48));
  EXPECT_THROW(learner.add(view, {NAN, 0.0, 0.0}), ContractError);
  learner.add(view, {});
  EXPECT_EQ(learner.finish(executor).chain.snapshots(), 1U);
  EXPECT_THROW(HomeFinder(SnapshotChain{}), ContractError);
}

TEST(DriftingPose, FixesShowTheDriftThatOdometryDoesNotSee) {
  DriftingPose pose({}, {});
  const double start_m = pose.deviation_m();
  Pose2 truth;
  for (int i = 0; i < 100; ++i) {
    const Pose2 next{0.1 * (i + 1), 0.0, 0.0};
    pose.move(measure(truth, next, 0.08));
    truth = next;
    if (i % 10 == 9) pose.correct(truth, 0.1, 0.05);
  }
  EXPECT_NEAR(pose.drift_m_per_m().y_m, 0.08, 0.02);
  EXPECT_NEAR(pose.drift_m_per_m().x_m, 0.0, 0.02);
  EXPECT_LT(distance(pose.pose().position(), truth.position()), 0.1);
  EXPECT_LT(pose.mismatch(truth, 0.1, 0.05), 11.0);
  EXPECT_GT(pose.mismatch({truth.x_m + 5.0, 0.0, 0.0}, 0.1, 0.05), 100.0);
  for (int i = 0; i < 100; ++i) pose.move({0.3, 0.0, 0.0});
  EXPECT_GT(pose.deviation_m(), start_m) << "grows without fixes";
}

// The result of a flight out along a triangle, and home.
struct Flight {
  ChainState state = ChainState::travelling;
  double end_m = 0.0;
};

// True if a step crosses a wall of 1.6 m, a metre beyond home.
bool crosses_wall(Point2 from, Point2 to) {
  constexpr double wall_y_m = 1.0;
  if ((from.y_m < wall_y_m) == (to.y_m < wall_y_m)) return false;
  const double part = (wall_y_m - from.y_m) / (to.y_m - from.y_m);
  return std::abs(from.x_m + part * (to.x_m - from.x_m)) < 0.8;
}

Flight fly(const ToyWorld& world, const HomeArea& area, const Pose2& home, double wind,
           const ToyWorld& world_of_return, bool has_wall = false) {
  const std::vector<Pose2> way = walk_along(
      {home.position(), {home.x_m + 12.0, home.y_m + 3.0}, {home.x_m + 5.0, home.y_m + 14.0}});
  HomeFinder finder(area.chain);
  Pose2 robot = home;
  const auto move_to = [&](const Pose2& pose, const ToyWorld& seen) {
    finder.move(measure(robot, pose, wind));
    robot = pose;
    if (finder.may_be_near()) finder.see(forest_view(seen, pose));
  };
  for (const Pose2& pose : way) move_to(pose, world);
  Flight flight;
  for (int step = 0; step < 3000; ++step) {
    const ChainDecision decision = finder.decide();
    flight.state = decision.state;
    if (flight.state == ChainState::arrived || flight.state == ChainState::lost) break;
    const Pose2 next =
        robot * Pose2{decision.advance_m * std::cos(decision.turn_rad),
                      decision.advance_m * std::sin(decision.turn_rad), decision.turn_rad};
    const bool is_blocked = has_wall && crosses_wall(robot.position(), next.position());
    move_to(is_blocked ? robot : next, world_of_return);
  }
  EXPECT_EQ(finder.decide().state, flight.state);
  flight.end_m = distance(robot.position(), home.position());
  return flight;
}

TEST(HomeFinder, LeadsHomeAgainstAWindAndIsNeverWrong) {
  for (const std::uint64_t seed : {3U, 4U}) {
    const ToyWorld world = forest(seed);
    const std::vector<Pose2> walk = petals({}, 3.0);
    const HomeArea area = learn(world, walk, 0.1);
    const Flight flight = fly(world, area, walk.front(), -0.1, world);
    EXPECT_EQ(flight.state, ChainState::arrived) << seed;
    EXPECT_LT(flight.end_m, 0.5) << seed;
    if (seed == 4U) continue;
    // Home has vanished: everything there looks different.
    EXPECT_EQ(fly(world, area, walk.front(), 0.1, forest(seed + 100)).state, ChainState::lost);
  }
}

TEST(HomeFinder, GoesAroundAWallBeforeHome) {
  int arrived = 0;
  for (const std::uint64_t seed : {11U, 12U, 13U}) {
    const ToyWorld world = forest(seed);
    const std::vector<Pose2> walk = petals({}, 3.0);
    const HomeArea area = learn(world, walk, 0.0);
    const Flight flight = fly(world, area, walk.front(), 0.0, world, true);
    if (flight.state != ChainState::arrived) continue;
    ++arrived;
    EXPECT_LT(flight.end_m, 0.5) << seed;
  }
  EXPECT_GE(arrived, 2);
}

}  // namespace
}  // namespace panonav::testing
