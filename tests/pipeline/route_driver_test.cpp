#include "panonav/pipeline/route_driver.hpp"

#include <gtest/gtest.h>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/route_recorder.hpp"
#include "panonav/route/route_position.hpp"
#include "panonav_simulation/simulated_odometry.hpp"
#include "support/remembered_worlds.hpp"
#include "support/smooth_path.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

/// A round through the first of two rooms that ends where it begins, remembered by odometry.
class RouteDriving : public ::testing::Test {
 protected:
  RouteDriving() {
    const auto round = smooth_path(
        std::vector<Point2>{{0.6, 0.7}, {3.0, 0.7}, {3.2, 2.9}, {0.8, 3.1}, {0.6, 0.7}}, 0.05);
    PictureSource source{.kind = PictureKind::panorama};
    source.layout.elevations = band;
    Memoriser memoriser(memory, {.source = source});
    for (std::size_t i = 0; i < round.size(); i += 4) {
      Observation seen(picture(round[i]));
      seen.name = "view " + std::to_string(i);
      memoriser.add(std::move(seen));
    }
    memoriser.finish();
    RouteRecorder recorder(memory, {.odometry = true});
    simulation::SimulatedOdometry drifting({}, 4);
    Pose2 before = round.front();
    for (const Pose2& pose : round) {
      Observation seen(picture(pose));
      seen.odometry = drifting.advance(inverse(before) * pose);
      before = pose;
      recorder.add(seen);
    }
    (void)recorder.finish();
    start = round.front();
    end = round.back();
    for (const Pose2& pose : round) path.push_back(pose);
  }

  static Image picture(const Pose2& pose) {
    return to_picture(world.panorama(pose, 24, 128, band));
  }

  /// Drives and returns the robot's final pose; `carry` may put it elsewhere at each step.
  Pose2 drive(Pose2 robot, std::uint64_t seed, RouteDriver::State& state,
              const std::function<void(int, Pose2&)>& carry = {}) {
    RouteDriver driver(MemoryFile::open(memory, Access::read_only), std::nullopt);
    simulation::SimulatedOdometry wheels({}, seed);
    Pose2 read;
    for (int i = 0; i < 2000; ++i) {
      Observation seen(picture(robot));
      seen.odometry = read;
      const RouteDriver::Step step = driver.step(seen);
      state = step.state;
      if (state == RouteDriver::State::arrived || state == RouteDriver::State::lost) {
        EXPECT_EQ(step.velocity, Velocity{});
        break;
      }
      const Pose2 moved = integrate_velocity(step.velocity, BaseOptions{}.period_s);
      read = wheels.advance(moved);
      robot = robot * moved;
      way_m += std::hypot(moved.x_m, moved.y_m);
      max_lateral_m =
          std::max(max_lateral_m, std::abs(project_onto_route(path, robot.position()).lateral_m));
      if (carry) carry(i, robot);
    }
    return robot;
  }

  static constexpr ElevationBand band{-0.45, 0.6};
  inline static const ToyWorld world = two_rooms(3, false);
  TemporaryFolder folder;
  std::filesystem::path memory = folder / "round.panonav";
  std::vector<Pose2> path;
  Pose2 start, end;
  double way_m = 0.0;
  double max_lateral_m = 0.0;
};

TEST_F(RouteDriving, RepeatsARoundFromItsBeginningToItsEnd) {
  RouteDriver::State state{};
  const Pose2 robot = drive(start * Pose2{0.0, 0.1, 0.3}, 9, state);
  EXPECT_EQ(state, RouteDriver::State::arrived);
  EXPECT_LT(distance(robot.position(), end.position()), 0.1);
  EXPECT_GT(way_m, 8.0);  // not at its end from the beginning
  EXPECT_LT(max_lateral_m, 0.15);
}

TEST_F(RouteDriving, ARobotThatIsNowhereOnItStands) {
  RouteDriver::State state{};
  const Pose2 away{6.8, 1.0, 0.5};
  EXPECT_EQ(drive(away, 9, state), away);
  EXPECT_EQ(state, RouteDriver::State::lost);

  // Carried into the other room on its way, it does not go on for long.
  way_m = 0.0;
  (void)drive(start, 9, state, [&](int i, Pose2& robot) {
    if (i == 50) {
      robot = away;
      way_m = 0.0;
    }
  });
  EXPECT_EQ(state, RouteDriver::State::lost);
  EXPECT_LT(way_m, RouteDriver::max_blind_m + 0.1);

  RouteDriver driver(MemoryFile::open(memory, Access::read_only), std::nullopt);
  EXPECT_THROW((void)driver.step(picture(start)), ContractError);
}

TEST_F(RouteDriving, GoesOnWhereItWasAndBelievesAWitness) {
  Observation first(picture(start));
  first.odometry = Pose2{};
  for (const bool resumed : {false, true}) {  // the round ends where it begins
    RouteDriverOptions options;
    if (resumed) options.resume_m = 100.0;
    RouteDriver driver(MemoryFile::open(memory, Access::read_only), std::nullopt, options);
    const RouteDriver::Step step = driver.step(first);
    EXPECT_EQ(step.along_m > 0.5 * step.length_m, resumed) << step.along_m;
  }
  for (const bool witness : {false, true}) {
    RouteDriver driver(MemoryFile::open(memory, Access::read_only), std::nullopt);
    RouteDriver::Step step = driver.step(first);
    for (int i = 1; i < 30; ++i) {  // 1.5 m without a line that fits
      Observation blind(picture({6.8, 1.0, 0.5}));
      blind.odometry = Pose2{0.05 * i, 0.0, 0.0};
      const auto robot = driver.follower().tracker().pose();
      if (step.state != RouteDriver::State::lost) {
        step = driver.step(blind, witness ? robot : std::nullopt);
      }
    }
    EXPECT_EQ(step.state, witness ? RouteDriver::State::driving : RouteDriver::State::lost);
  }
}

/// The same round, remembered as a chain of snapshots.
class ChainDriving : public RouteDriving {
 protected:
  ChainDriving() {
    auto file = MemoryFile::open(memory, Access::read_write);
    const HomingEncoder encoder(file.header(), file.header().source);
    ChainRecorder recorder;
    simulation::SimulatedOdometry drifting({}, 4);
    Pose2 read;
    for (std::size_t i = 0; i < path.size(); ++i) {
      const Pose2 before = read;
      if (i > 0) read = drifting.advance(inverse(path[i - 1]) * path[i]);
      recorder.add(encoder.view(encoder.panorama(Observation(picture(path[i])))),
                   inverse(before) * read);
    }
    file.save_chain("home", recorder.finish());
  }

  /// Drives and returns the robot's final pose; `carry` may put it elsewhere at each step.
  Pose2 drive_chain(Pose2 robot, ChainDirection direction, DriveKind drive, ChainState& state,
                    const std::function<void(int, Pose2&)>& carry = {}) {
    const BaseOptions base{.drive = drive};
    ChainDriver driver(MemoryFile::open(memory, Access::read_only), std::nullopt, "home", direction,
                       base);
    simulation::SimulatedOdometry wheels({}, 9);
    Pose2 read;
    decisions = 0;
    for (int i = 0; i < 1000; ++i) {
      Observation seen(picture(robot));
      seen.odometry = read;
      const ChainDriver::Step step = driver.step(seen);
      state = step.state;
      decisions += step.decided ? 1 : 0;
      EXPECT_LE(step.snapshot, driver.chain().snapshots());
      if (state == ChainState::arrived || state == ChainState::lost) {
        EXPECT_EQ(step.velocity, Velocity{});
        EXPECT_EQ(driver.step(seen).velocity, Velocity{});
        break;
      }
      const Pose2 moved = integrate_velocity(step.velocity, base.period_s);
      read = wheels.advance(moved);
      robot = robot * moved;
      way_m += std::hypot(moved.x_m, moved.y_m);
      if (carry) carry(i, robot);
    }
    return robot;
  }

  int decisions = 0;
};

TEST_F(ChainDriving, RepeatsTheChainInBothDirectionsWithEveryDrive) {
  for (const ChainDirection direction : {ChainDirection::forward, ChainDirection::back}) {
    for (const DriveKind drive : {DriveKind::differential, DriveKind::holonomic}) {
      const bool is_back = direction == ChainDirection::back;
      way_m = 0.0;
      ChainState state{};
      const Pose2 robot =
          drive_chain((is_back ? end : start) * Pose2{0.0, 0.1, 0.3}, direction, drive, state);
      EXPECT_EQ(state, ChainState::arrived);
      EXPECT_LT(distance(robot.position(), (is_back ? start : end).position()), 0.2);
      EXPECT_GT(way_m, 8.0);      // the round ends where it begins
      EXPECT_LT(decisions, 400);  // a motion takes several periods
    }
  }
}

TEST_F(ChainDriving, ARobotThatWasCarriedAwayDoesNotClaimToHaveArrived) {
  ChainState state{};
  (void)drive_chain(start, ChainDirection::forward, DriveKind::differential, state,
                    [&](int i, Pose2& robot) {
                      if (i == 60) robot = {6.8, 1.0, 0.5};
                    });
  EXPECT_NE(state, ChainState::arrived);
  ChainDriver driver(MemoryFile::open(memory, Access::read_only), std::nullopt, "home",
                     ChainDirection::back);
  EXPECT_THROW((void)driver.step(picture(start)), ContractError);
  EXPECT_THROW(ChainDriver(MemoryFile::open(memory, Access::read_only), std::nullopt, "nowhere",
                           ChainDirection::back),
               FileError);
}

}  // namespace
}  // namespace panonav::testing
