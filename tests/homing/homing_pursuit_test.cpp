#include "panonav/homing/homing_pursuit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

HomingView seen_from(const ToyWorld& world, const Pose2& pose, int components = 14) {
  return homing_view(striped_signature(world, pose, components));
}

struct Ended {
  HomingPursuit::State state = HomingPursuit::State::moving;
  Pose2 pose;
  int steps = 0;
};

// A robot that executes each command exactly.
Ended run(const ToyWorld& world, HomingPursuit pursuit, Pose2 pose) {
  for (;;) {
    const HomingPursuit::Decision decision = pursuit.decide(seen_from(world, pose));
    if (decision.state != HomingPursuit::State::moving) {
      EXPECT_EQ(decision.advance_m, 0.0);
      return {decision.state, pose, pursuit.steps()};
    }
    pose = pose * Pose2{0.0, 0.0, decision.turn_rad} * Pose2{decision.advance_m, 0.0, 0.0};
    if (std::hypot(pose.x_m, pose.y_m) > 2.8)
      return {HomingPursuit::State::moving, pose, pursuit.steps()};
  }
}

TEST(HomingPursuit, ReachesHomeFromAllAroundWhateverTheHeading) {
  for (const auto strategy :
       {HomingPursuitOptions::Strategy::steady, HomingPursuitOptions::Strategy::coarse_to_fine,
        HomingPursuitOptions::Strategy::recovering}) {
    Random random(5);
    int arrived = 0;
    constexpr int starts = 60;
    for (int i = 0; i < starts; ++i) {
      const ToyWorld world = striped_round_room(3.0, 100 + static_cast<std::uint64_t>(i % 10));
      const Pose2 home{random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8),
                       random.uniform(-std::numbers::pi, std::numbers::pi)};
      const double direction = random.uniform(-std::numbers::pi, std::numbers::pi);
      const double way_m = random.uniform(0.1, 1.0);
      const Pose2 start{home.x_m + way_m * std::cos(direction),
                        home.y_m + way_m * std::sin(direction),
                        random.uniform(-std::numbers::pi, std::numbers::pi)};
      const HomingPursuitOptions options{.strategy = strategy, .typical_distance_m = 3.0};
      const Ended end = run(world, HomingPursuit(seen_from(world, home), options), start);
      arrived += end.state == HomingPursuit::State::arrived &&
                 distance(end.pose.position(), home.position()) < 0.05;
    }
    EXPECT_GE(arrived, starts * 9 / 10) << "strategy " << static_cast<int>(strategy);
  }
}

TEST(HomingPursuit, StepIsThatOfThePaper) {
  const ToyWorld world = striped_round_room(3.0, 7);
  const HomingView home = seen_from(world, {0.0, 0.0, 0.3});
  for (const double way_m : {0.1, 0.8}) {
    const HomingView current = seen_from(world, {way_m, 0.0, -1.0});
    const HomeVector vector = home_vector(home, current);
    const HomingPursuit::Decision decision = HomingPursuit(home).decide(current);
    ASSERT_EQ(decision.state, HomingPursuit::State::moving);
    EXPECT_EQ(decision.turn_rad, vector.direction_rad());
    EXPECT_EQ(decision.advance_m, std::min(0.3, 3.0 * vector.length()));
    EXPECT_EQ(decision.difference, image_difference(home, current));
  }
}

TEST(HomingPursuit, EndsThoughTheThingsAroundAreMuchNearerThanAssumed) {
  // Every step goes far beyond the goal: without a shorter step it would run to and fro for ever.
  const ToyWorld world = striped_round_room(3.0, 8);
  const Pose2 home{0.2, 0.1, 1.0};
  const HomingPursuitOptions far{.typical_distance_m = 9.0, .max_step_m = 2.0};
  const Ended end = run(world, HomingPursuit(seen_from(world, home), far), {0.5, -0.1, 2.0});
  EXPECT_EQ(end.state, HomingPursuit::State::arrived);
  EXPECT_LT(distance(end.pose.position(), home.position()), 0.1);
  EXPECT_LT(end.steps, 30);
}

TEST(HomingPursuit, NoticesAWrongPlace) {
  // One row with most of its energy in one frequency: even unrelated views look much alike.
  const HomingPursuitOptions strict{.arrived_difference = 0.05};
  int stopped = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const ToyWorld world = striped_round_room(3.0, seed);
    const ToyWorld other = striped_round_room(3.0, seed + 1000);
    const HomingView home = seen_from(other, {0.1, 0.2, 0.0});
    EXPECT_EQ(run(other, HomingPursuit(home, strict), {0.4, 0.0, 0.0}).state,
              HomingPursuit::State::arrived)
        << "seed " << seed;
    const Ended end = run(world, HomingPursuit(home, strict), {0.4, 0.0, 0.0});
    EXPECT_NE(end.state, HomingPursuit::State::arrived) << "seed " << seed;
    stopped += end.state == HomingPursuit::State::wrong_place;
  }
  EXPECT_GT(stopped, 0);
}

TEST(HomingPursuit, StopsAtOnceAtHomeAndStaysStopped) {
  const ToyWorld world = striped_round_room(3.0, 9);
  const HomingView home = seen_from(world, {});
  HomingPursuit pursuit(home);
  for (int i = 0; i < 3; ++i) {
    const HomingPursuit::Decision decision =
        pursuit.decide(i < 2 ? home : seen_from(world, {0.8, 0.2, 1.0}));
    EXPECT_EQ(decision.state, HomingPursuit::State::arrived);
    EXPECT_EQ(decision.advance_m, 0.0);
    if (i < 2) {
      EXPECT_NEAR(decision.difference, 0.0, 1e-5);
    }
  }
  EXPECT_EQ(pursuit.steps(), 0);
}

TEST(HomingPursuit, GivesUpAfterTheMostSteps) {
  const ToyWorld world = striped_round_room(3.0, 10);
  HomingPursuit pursuit(seen_from(world, {}), {.max_steps = 3});
  const HomingView stuck = seen_from(world, {0.9, 0.0, 0.0});
  for (int i = 0; i < 3; ++i) EXPECT_EQ(pursuit.decide(stuck).state, HomingPursuit::State::moving);
  EXPECT_EQ(pursuit.decide(stuck).state, HomingPursuit::State::exhausted);
}

TEST(HomingPursuit, StopsWhereViewsBecomeNoMoreAlike) {
  const ToyWorld world = striped_round_room(3.0, 10);
  HomingPursuit pursuit(seen_from(world, {}),
                        {.strategy = HomingPursuitOptions::Strategy::steady, .patience = 3});
  const HomingView stuck = seen_from(world, {0.9, 0.0, 0.0});
  for (int i = 0; i < 3; ++i) EXPECT_EQ(pursuit.decide(stuck).state, HomingPursuit::State::moving);
  EXPECT_EQ(pursuit.decide(stuck).state, HomingPursuit::State::wrong_place);
}

TEST(HomingPursuit, CoarseToFineGoesThroughItsStages) {
  const ToyWorld world = striped_round_room(3.0, 11);
  const HomingView home = seen_from(world, {});
  HomingPursuit pursuit(home, {.strategy = HomingPursuitOptions::Strategy::coarse_to_fine});
  EXPECT_EQ(pursuit.decide(seen_from(world, {0.8, 0.1, 0.0})).stage, 0);
  const HomingPursuit::Decision last = pursuit.decide(home);
  EXPECT_EQ(last.stage, 2);
  EXPECT_EQ(last.state, HomingPursuit::State::arrived);
}

TEST(HomingPursuit, ChecksItsInputs) {
  const ToyWorld world = striped_round_room(3.0, 12);
  EXPECT_THROW(HomingPursuit(seen_from(world, {}), {.typical_distance_m = 0.0}), OptionError);
  EXPECT_THROW(HomingPursuit(seen_from(world, {}), {.max_steps = 0}), OptionError);
  HomingPursuit pursuit(seen_from(world, {}));
  const std::vector<float> zeros(2 * 14);
  EXPECT_THROW((void)pursuit.decide(HomingView(2, 14, zeros, zeros)), ContractError) << "rows";
}

}  // namespace
}  // namespace panonav::testing
