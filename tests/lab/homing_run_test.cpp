// Robots that drive home in simulated rooms.

#include "lab/runs/homing_run.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav_simulation/scenes.hpp"
#include "support/skips.hpp"

namespace panonav::lab {
namespace {

HomingCamera small_camera() {
  HomingCamera camera;
  camera.rendering = {.rows = 20, .columns = 128, .rays_per_axis = 1};
  return camera;
}

const HomingPlace& place_of(const std::string& name) {
  static Executor executor(2);
  static const HomingPlace lab =
      make_homing_place(simulation::make_scene("lab"), small_camera(), executor);
  static const HomingPlace office =
      make_homing_place(simulation::make_scene("office"), small_camera(), executor);
  return name == "lab" ? lab : office;
}

std::size_t successes(const std::vector<HomingRun>& runs, double radius_m = 0.1) {
  return static_cast<std::size_t>(std::count_if(
      runs.begin(), runs.end(), [&](const HomingRun& run) { return run.is_success(radius_m); }));
}

TEST(HomingRun, BothDrivesGetHomeInOfficeAndLab) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor executor(2);
  for (const char* const name : {"lab", "office"}) {
    const HomingPlace& place = place_of(name);
    const auto tasks = sample_homing_tasks(place, 30, 1.0, 5);
    for (const DriveKind drive : {DriveKind::differential, DriveKind::holonomic}) {
      HomingRunOptions options;
      options.motion.drive = drive;
      const auto runs = run_home(place, tasks, options, 6, executor);
      EXPECT_GE(successes(runs), 27U) << name << ", drive " << static_cast<int>(drive);
      for (std::size_t i = 0; i < runs.size(); ++i) {
        ASSERT_FALSE(runs[i].path.empty());
        EXPECT_EQ(runs[i].path.front(), tasks[i].start);
        for (const Pose2& pose : runs[i].path) {
          EXPECT_TRUE(place.free_space->is_free(pose.position())) << "through an obstacle";
        }
        EXPECT_NEAR(distance(runs[i].path.back().position(), tasks[i].goal.position()),
                    runs[i].end_distance_m, 1e-12);
      }
    }
  }
}

// The floor of the office ends at the border of its map without a wall, near which ranges are
// measured, too.
TEST(HomingRun, ARingOfRangesGetsHomeAsOftenAsABumperAlone) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor executor(2);
  const auto tasks = sample_homing_tasks(place_of("office"), 24, 1.0, 5);
  HomingRunOptions options;
  const std::size_t bumper = successes(run_home(place_of("office"), tasks, options, 6, executor));
  options.sensor = simulation::ObstacleSensor::ranges;
  EXPECT_GE(successes(run_home(place_of("office"), tasks, options, 6, executor)) + 1, bumper);
}

TEST(HomingRun, ATiltedRobotGetsHomeWithAnInertialSensorAndWithout) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor executor(2);
  HomingPlace place = place_of("office");
  place.camera.frame.tilt_rad = radians(6.0);
  const auto tasks = sample_homing_tasks(place, 20, 1.0, 5);
  HomingRunOptions blind;
  blind.vector.tilt = false;
  EXPECT_LE(successes(run_home(place, tasks, blind, 6, executor)), 10U);
  EXPECT_GE(successes(run_home(place, tasks, {}, 6, executor)), 17U);
  place.camera.levelled = true;
  EXPECT_GE(successes(run_home(place, tasks, {}, 6, executor)), 18U);
}

TEST(HomingRun, AHolonomicRobotDoesNotTurn) {
  const HomingPlace& place = place_of("lab");
  const auto tasks = sample_homing_tasks(place, 3, 1.0, 7);
  HomingRunOptions options;
  options.motion = {.drive = DriveKind::holonomic,
                    .translation_from_translation = 0.0,
                    .translation_from_rotation = 0.0,
                    .rotation_from_translation = 0.0,
                    .rotation_from_rotation = 0.0};
  Executor executor(1);
  for (const HomingRun& run : run_home(place, tasks, options, 8, executor)) {
    EXPECT_GT(run.path.size(), 1U);
    for (const Pose2& pose : run.path) {
      EXPECT_NEAR(wrap_angle(pose.heading_rad - run.path.front().heading_rad), 0.0, 1e-9);
    }
  }
}

TEST(HomingRun, AnObstacleStopsARobotThatMayNotGoPast) {
  const HomingPlace& place = place_of("office");
  HomingRunOptions options;
  options.obstacles = simulation::ObstacleRule::stop;
  std::size_t blocked = 0;
  Random random(11);
  for (int i = 0; i < 12; ++i) {
    const Pose2 start = place.free_space->random_pose(random);
    // Home was seen by a camera where no robot can stand, behind the edge of the free space.
    for (int k = 0; k < 16; ++k) {
      const Pose2 goal = start * Pose2{0.0, 0.0, k * 0.4} * Pose2{0.6, 0.0, 0.0};
      if (place.free_space->is_free(goal.position())) continue;
      const HomingRun run =
          run_home(place, capture_homing_view(place, goal, 1), goal, start, options, 3);
      if (run.end == HomingRunEnd::blocked) {
        ++blocked;
        EXPECT_TRUE(run.met_obstacle);
        EXPECT_TRUE(place.free_space->is_free(run.path.back().position()));
        EXPECT_FALSE(run.is_success(10.0)) << "a robot that is stopped does not arrive";
      }
      break;
    }
  }
  EXPECT_GE(blocked, 3U);
}

TEST(HomingRun, KeepsHowMuchTheFirstViewDiffersFromHome) {
  const HomingPlace& place = place_of("lab");
  Executor executor(2);
  for (const HomingRun& run :
       run_home(place, sample_homing_tasks(place, 6, 0.8, 23), {}, 24, executor)) {
    if (run.end != HomingRunEnd::arrived) continue;
    EXPECT_LE(run.end_difference, 0.08);
    // Views of one room differ the more the farther they are apart.
    if (distance(run.path.front().position(), run.goal.position()) > 0.3) {
      EXPECT_GT(run.start_difference, 2.0 * run.end_difference);
    }
    EXPECT_LE(run.start_difference, 1.0);
  }
}

TEST(HomingRun, SaysThatItIsNotHomeWhereHomeWasSeenInAnotherRoom) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const HomingPlace& lab = place_of("lab");
  const HomingPlace& office = place_of("office");
  Random random(13);
  for (int i = 0; i < 8; ++i) {
    const HomingView home = capture_homing_view(office, office.free_space->random_pose(random), 1);
    const Pose2 start = lab.free_space->random_pose(random);
    const HomingRun run = run_home(lab, home, start, start, {}, 3);
    EXPECT_NE(run.end, HomingRunEnd::arrived) << "run " << i << ", " << to_string(run.end);
    EXPECT_GT(run.end_difference, 0.08);
  }
}

TEST(HomingRun, SameSeedSameBitsOnAnyNumberOfThreads) {
  const HomingPlace& place = place_of("lab");
  const auto tasks = sample_homing_tasks(place, 4, 1.0, 17);
  Executor one(1);
  Executor three(3);
  const auto a = run_home(place, tasks, {}, 18, one);
  const auto b = run_home(place, tasks, {}, 18, three);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].path, b[i].path);
    EXPECT_EQ(a[i].end, b[i].end);
    EXPECT_EQ(a[i].end_difference, b[i].end_difference);
  }
  const auto other = run_home(place, tasks, {}, 19, one);
  EXPECT_NE(a.front().path, other.front().path) << "another seed, other noise";
}

TEST(HomingRun, ChecksItsInputs) {
  const HomingPlace& place = place_of("lab");
  EXPECT_THROW((void)sample_homing_tasks(place, 0, 1.0, 1), ContractError);
  EXPECT_THROW((void)sample_homing_tasks(place, 1, 0.0, 1), ContractError);
  const HomingView home = capture_homing_view(place, {}, 1);
  EXPECT_THROW((void)run_home(place, home, {}, {1e3, 0.0, 0.0}, {}, 1), ContractError);
  HomingRunOptions broken;
  broken.motion.rotation_from_rotation = -1.0;
  Random random(1);
  EXPECT_THROW((void)run_home(place, home, {}, place.free_space->random_pose(random), broken, 1),
               OptionError);
}

}  // namespace
}  // namespace panonav::lab
