#include "panonav_simulation/obstacle_sense.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "panonav/geometry/angles.hpp"
#include "panonav_simulation/mission.hpp"
#include "panonav_simulation/scene_builder.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/simulated_robot.hpp"
#include "support/scene_views.hpp"

namespace panonav::simulation {
namespace {

const MissionPlace& loop_with_walls() {
  Executor executor(2);
  static const MissionPlace place = make_mission_place(make_scene("loop", {.seed = 3}), executor);
  return place;
}

TEST(ObstacleMemory, BlocksOnlyDirectionsThatLeadIntoAKnownPoint) {
  constexpr double radius_m = 0.2;
  ObstacleMemory known;
  EXPECT_TRUE(known.is_open(0.0, 1.0, radius_m));
  known.add({0.22, 0.0});
  EXPECT_FALSE(known.is_open(0.0, 0.3, radius_m));
  EXPECT_TRUE(known.is_open(std::numbers::pi / 2.0, 1.0, radius_m));
  EXPECT_TRUE(known.is_open(std::numbers::pi, 1.0, radius_m));
  known.move({0.1, 0.5, 0.0});  // now it is on the right
  EXPECT_TRUE(known.is_open(0.0, 1.0, radius_m));
  EXPECT_FALSE(known.is_open(-std::numbers::pi / 2.0, 1.0, radius_m));
  known.advance(60.0);
  EXPECT_TRUE(known.is_open(-std::numbers::pi / 2.0, 1.0, radius_m));
}

TEST(ObstacleMemory, FartherRangesDisproveNearerOnesButNoContact) {
  constexpr double radius_m = 0.2;
  for (const bool is_felt : {false, true}) {
    ObstacleMemory known;
    std::array<double, sensor_directions> ranges_m{};
    ranges_m.fill(max_range_m);
    ranges_m[2] = 0.5;
    known.add_ranges(ranges_m);
    if (is_felt) known.add({0.0, 0.4});
    const double left_rad = std::numbers::pi / 2.0;
    EXPECT_FALSE(known.is_open(left_rad, 0.5, radius_m));
    EXPECT_EQ(known.is_open(left_rad, 0.5, radius_m, false), !is_felt);
    ranges_m[2] = 1.5;
    known.add_ranges(ranges_m);
    EXPECT_EQ(known.is_open(left_rad, 0.5, radius_m), !is_felt);
    EXPECT_FALSE(known.is_open(left_rad, 1.5, radius_m));
  }
}

TEST(Ranges, EndInObstaclesWithinTheirNoise) {
  const MissionPlace& place = loop_with_walls();
  const FreeSpace& space = *place.free_space;
  Random random(5);
  int far = 0;
  int all = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const Pose2 robot = space.random_pose(random);
    const auto ranges_m = measure_ranges(space, nullptr, robot, random);
    for (std::size_t i = 0; i < ranges_m.size(); ++i) {
      ASSERT_GE(ranges_m[i], 0.0);
      ASSERT_LE(ranges_m[i], max_range_m);
      if (ranges_m[i] >= max_range_m) continue;
      const double direction_rad = sensor_direction_rad(i);
      constexpr double step_m = 0.01;
      const double noise_m = step_m + 3.0 * (range_noise_factor * ranges_m[i] + range_noise_m);
      double truth_m = 0.0;
      const auto clearance_at = [&](double range_m) {
        return space.clearance_m(
            robot * Point2{range_m * std::cos(direction_rad), range_m * std::sin(direction_rad)});
      };
      while (truth_m < max_range_m && clearance_at(truth_m) > 0.0) truth_m += 0.005;
      ++all;
      far += std::abs(truth_m - ranges_m[i]) > noise_m ? 1 : 0;
    }
  }
  EXPECT_GT(all, 100);
  EXPECT_LE(far, all / 50);
}

TEST(Missions, ArriveWithEachSensorAlmostAsOftenAsWithTheTruth) {
  Executor two(2);
  MissionPlace place = make_mission_place(make_scene("office", {.seed = 71}), two);
  add_floor_camera(place);
  const RememberedPlace remembered = memorise_grid(place, 0.5, 5, two);
  const auto missions = sample_missions(place, remembered, {.count = 10}, 3);
  const auto count_arrived = [&](ObstacleSensor sensor) {
    MissionOptions options;
    options.obstacles = sensor;
    int arrived = 0;
    for (const MissionRun& run : run_missions(place, remembered, missions, options, 9, two)) {
      for (const Pose2& pose : run.path) {
        constexpr double cell_m = 0.025;
        EXPECT_GE(place.free_space->clearance_m(pose.position()),
                  place.scene.robot_radius_m - cell_m);
      }
      arrived += run.has_arrived(0.25) ? 1 : 0;
    }
    return arrived;
  };
  const int with_truth = count_arrived(ObstacleSensor::truth);
  EXPECT_GE(10 * count_arrived(ObstacleSensor::bumper), 8 * with_truth);
  EXPECT_GE(10 * count_arrived(ObstacleSensor::ranges), 8 * with_truth);
  EXPECT_GE(10 * count_arrived(ObstacleSensor::camera), 8 * with_truth);
  place.floor_camera.reset();
  EXPECT_THROW(count_arrived(ObstacleSensor::camera), ContractError);
}

TEST(ObstacleMemory, HoldsTheEndsOfTheFloorUntilAScanShowsFloorThere) {
  FloorScan scan{std::vector<std::optional<double>>(64, 1.0), 1.0};
  scan.range_m[16] = 0.4;  // to the left
  ObstacleMemory memory;
  memory.add_scan(scan);
  const double left_rad = std::numbers::pi / 2.0;
  EXPECT_FALSE(memory.is_open(left_rad, 0.4, 0.2));
  EXPECT_TRUE(memory.is_open(left_rad, 0.4, 0.2, false));
  EXPECT_TRUE(memory.is_open(left_rad, 0.15, 0.2));
  EXPECT_TRUE(memory.is_open(0.0, 0.9, 0.2));
  scan.range_m[16].reset();  // says nothing
  memory.add_scan(scan);
  EXPECT_FALSE(memory.is_open(left_rad, 0.4, 0.2));
  scan.range_m[16] = 1.0;
  memory.add_scan(scan);
  EXPECT_TRUE(memory.is_open(left_rad, 0.4, 0.2));
}

// Returns a room with nothing in it, from -half to half in x and y.
Scene make_empty_room(double half_m) {
  SceneBuilder builder("room", {});
  const int grey = builder.add_plain_material({0.5F, 0.5F, 0.5F});
  builder.add_floor(grey, {-half_m, -half_m}, {half_m, half_m}, 1.0);
  const std::array<Point2, 4> corners{
      {{-half_m, -half_m}, {half_m, -half_m}, {half_m, half_m}, {-half_m, half_m}}};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    builder.add_wall("wall", grey, corners[i], corners[(i + 1) % corners.size()], 2.0, 1.0);
  }
  Scene scene = builder.scene();
  scene.floor_low = corners[0];
  scene.floor_high = corners[2];
  return scene;
}

FreeSpace find_free_space(const Scene& scene) {
  return FreeSpace(scene, free_space_options(scene));
}

TEST(Contact, BlocksTheDirectionIntoTheWall) {
  Executor two(2);
  const MissionPlace place = make_mission_place(make_empty_room(1.5), two);
  const BaseOptions base;
  for (int k = 0; k < 16; ++k) {
    // From the middle, the wall is at most 45 degrees aside of the course; the bumper rounds this
    // to one of eight sides, so it always knows that straight on is blocked.
    MissionRobot robot(place, base, testing::exact_odometry(),
                       {0.0, 0.0, -std::numbers::pi + k * std::numbers::pi / 8.0}, 1);
    for (int step = 0; step < 2000 && robot.contacts() == 0; ++step) {
      EXPECT_EQ(robot.find_free_direction(0.0, 0.3), 0.0);  // a bumper knows nothing before contact
      robot.command({.forward_m_s = base.speed_m_s});
    }
    EXPECT_TRUE(robot.take_contact());
    EXPECT_NE(robot.find_free_direction(0.0, 0.3), 0.0) << k;
    robot.back_off();
    EXPECT_FALSE(robot.take_contact()) << k;
    EXPECT_NE(robot.find_free_direction(0.0, 0.3), 0.0) << k;
    EXPECT_GE(place.free_space->clearance_m(robot.pose().position()), place.scene.robot_radius_m);
  }
}

constexpr std::array sensors{ObstacleSensor::bumper, ObstacleSensor::ranges, ObstacleSensor::truth};

TEST(Ranges, DoNotEndWhereTheMapEndsWithoutAnObstacle) {
  Scene scene = make_empty_room(1.5);
  scene.floor_low = {-1.5, -1.5};
  scene.floor_high = {0.5, 1.5};  // the wall in front is a metre beyond the map
  const FreeSpace space = find_free_space(scene);
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const auto ranges_m = measure_ranges(space, nullptr, {0.4, 0.0, 0.0}, random);
    EXPECT_EQ(ranges_m[0], max_range_m);
    EXPECT_NEAR(ranges_m[2], 1.5, 0.2);
    EXPECT_NEAR(ranges_m[4], 1.9, 0.2);
  }
}

TEST(SimulatedRobot, StopsWhereItIsEnclosed) {
  const FreeSpace space = find_free_space(make_empty_room(0.3));
  for (const ObstacleSensor sensor : sensors) {
    SimulatedRobot robot(space, testing::exact_odometry(), ObstacleRule::pass, {}, 1, sensor);
    for (int i = 0; i < 5; ++i) {
      const auto step = robot.drive(0.3 * i, 0.8);
      EXPECT_TRUE(step.has_met_obstacle);
      EXPECT_TRUE(step.is_stopped || sensor == ObstacleSensor::truth);
      EXPECT_TRUE(space.is_free(robot.pose().position()));
    }
  }
}

TEST(SimulatedRobot, StaysInItsPlaceInAStepOfZero) {
  const FreeSpace space = find_free_space(make_empty_room(1.0));
  for (const ObstacleSensor sensor : sensors) {
    for (const ObstacleRule rule : {ObstacleRule::stop, ObstacleRule::pass}) {
      SimulatedRobot robot(space, testing::exact_odometry(), rule, {0.5, 0.2, 0.1}, 1, sensor);
      const auto step = robot.drive(0.0, 0.0);
      EXPECT_FALSE(step.has_met_obstacle);
      EXPECT_FALSE(step.is_stopped);
      EXPECT_EQ(robot.pose(), Pose2(0.5, 0.2, 0.1));
    }
  }
}

TEST(SimulatedRobot, DrivesAlongAWallThatItTouchedTwice) {
  const FreeSpace space = find_free_space(make_empty_room(2.0));
  for (const ObstacleSensor sensor : sensors) {
    for (const DriveKind drive : {DriveKind::differential, DriveKind::holonomic}) {
      OdometryNoise exact = testing::exact_odometry();
      exact.drive = drive;
      SimulatedRobot robot(space, exact, ObstacleRule::pass, {1.2, 0.0, 0.0}, 1, sensor);
      int touched = 0;
      // It drives obliquely into the wall again and again.
      for (int i = 0; i < 4; ++i) {
        const double course_rad = 0.5 - robot.pose().heading_rad;
        const auto step = robot.drive(wrap_angle(course_rad), 0.4);
        EXPECT_FALSE(step.is_stopped);
        touched += step.has_met_obstacle ? 1 : 0;
      }
      EXPECT_GE(touched, 2);
      EXPECT_GT(robot.pose().y_m, 0.5);
      EXPECT_TRUE(space.is_free(robot.pose().position()));
    }
  }
}

TEST(SimulatedRobot, ReachesAPlaceInContactWithAWall) {
  const FreeSpace space = find_free_space(make_empty_room(1.0));
  for (const ObstacleSensor sensor : {ObstacleSensor::bumper, ObstacleSensor::ranges}) {
    SimulatedRobot robot(space, testing::exact_odometry(), ObstacleRule::pass, {}, 1, sensor);
    for (int i = 0; i < 3; ++i) {
      // The goal is the last free place in front of the wall.
      const double left_m = 0.75 - robot.pose().x_m;
      EXPECT_FALSE(robot.drive(-robot.pose().heading_rad, left_m).is_stopped);
    }
    EXPECT_NEAR(robot.pose().x_m, 0.75, 0.1);
    EXPECT_NEAR(robot.pose().y_m, 0.0, 0.15);
  }
}

}  // namespace
}  // namespace panonav::simulation
