#include "panonav/pipeline/tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/visual_motion.hpp"
#include "support/landmark_pictures.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

/// A memory of a 7 x 7 grid, and pictures of a drive on a circle around its middle.
class TrackerTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_.emplace();
    Memoriser memoriser(memory(), {.source = landmark_panoramas()});
    const auto poses = grid_poses(7);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      Observation seen(landmark_picture(world(), poses[i]));
      seen.name = view_name(i);
      seen.pose = ReferencePose{poses[i].x_m, poses[i].y_m, 0.0};
      memoriser.add(seen);
    }
    memoriser.finish();
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static std::filesystem::path memory() { return *folder_ / "grid.panonav"; }
  static ToyWorld world() { return landmark_world(7); }

  static Pose2 pose(int i) {
    const double angle = 2.0 * std::numbers::pi * i / 60.0;
    return {1.5 + std::cos(angle), 1.5 + std::sin(angle),
            wrap_angle(angle + 0.5 * std::numbers::pi)};
  }
  static Observation picture(int i) { return Observation(landmark_picture(world(), pose(i))); }

  static inline std::optional<TemporaryFolder> folder_;
};

TEST_F(TrackerTest, WithoutOdometryTheMotionIsThatOfThePictures) {
  Tracker tracker(memory());
  Tracker moved(memory(), {.odometry = visual_odometry_noise()});
  VisualOdometry motion = visual_odometry(moved.memory());
  MonteCarloEstimate last;
  for (int i = 0; i < 20; ++i) {
    motion.add(OdometryView(moved.encoder().signature(picture(i))));
    moved.move_to(motion.pose());
    last = moved.observe(moved.encoder().packed(picture(i)));
    EXPECT_EQ(tracker.observe(picture(i)).pose, last.pose);
    EXPECT_EQ(tracker.localiser().particles().x_m, moved.localiser().particles().x_m);
    ASSERT_NE(tracker.visual_odometry(), nullptr);
    EXPECT_EQ(tracker.visual_odometry()->pose(), motion.pose());
    EXPECT_EQ(tracker.visual_odometry()->scale_m(), motion.scale_m());
  }
  ASSERT_TRUE(last.pose);
  EXPECT_LT(distance(last.pose->position(), pose(19).position()), 0.25);
}

// The robot may have moved where its images do not show how.
TEST_F(TrackerTest, AStepThatCannotBeReadSpreadsTheParticles) {
  const auto deviation_m = [](const Tracker& tracker) {
    const Particles& particles = tracker.localiser().particles();
    double sum = 0.0;
    double squares = 0.0;
    for (const double x : particles.x_m) {
      sum += x;
      squares += x * x;
    }
    const auto count = static_cast<double>(particles.size());
    return std::sqrt(std::max(0.0, squares / count - sum / count * (sum / count)));
  };
  const FourierSignature blank = Tracker(memory()).encoder().signature(Observation(Image(96, 12)));
  Tracker tracker(memory());
  tracker.start_at(pose(0), 0.0, 0.0);
  tracker.move_by_image(tracker.encoder().signature(picture(0)));
  EXPECT_EQ(deviation_m(tracker), 0.0) << "the first image shows no motion";
  tracker.move_by_image(blank);
  EXPECT_EQ(tracker.visual_odometry()->breaks(), 1);
  const double spacing_m = tracker.localiser().model().spacing_m;
  EXPECT_NEAR(deviation_m(tracker), spacing_m, 0.1 * spacing_m) << "no step is known";
  // Steps of the circle are shorter than the spacing of the memory.
  Tracker moving(memory());
  moving.start_at(pose(0), 0.0, 0.0);
  for (int i = 0; i < 4; ++i) moving.move_by_image(moving.encoder().signature(picture(i)));
  const double before_m = deviation_m(moving);
  moving.move_by_image(blank);
  EXPECT_GT(deviation_m(moving), before_m);
  EXPECT_LT(deviation_m(moving), spacing_m);
}

TEST_F(TrackerTest, TheNoiseOfTheOptionsAppliesToBothKindsOfMotion) {
  const OdometryNoise none{DriveKind::holonomic, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  Tracker tracker(memory(), {.odometry = none});
  tracker.start_at(pose(0), 0.0, 0.0);
  (void)tracker.observe(picture(0));
  tracker.move_by_image(tracker.encoder().signature(picture(3)));
  const Pose2 expected = pose(0) * tracker.visual_odometry()->pose();
  for (const double x_m : tracker.localiser().particles().x_m) EXPECT_NEAR(x_m, expected.x_m, 1e-9);
  EXPECT_GT(distance(expected.position(), pose(0).position()), 0.1);
}

TEST_F(TrackerTest, OdometryReplacesTheMotionOfThePictures) {
  Tracker tracker(memory());
  tracker.start_at(pose(0), 0.0, 0.0);
  (void)tracker.observe(picture(0));
  (void)tracker.observe(picture(1));
  const auto before = tracker.localiser().particles();
  tracker.move_to({50.0, 3.0, 1.0});  // in another frame, so it is only stored
  EXPECT_EQ(tracker.localiser().particles().x_m, before.x_m);
  EXPECT_EQ(tracker.odometry(), (Pose2{50.0, 3.0, 1.0}));
  (void)tracker.observe(picture(5));  // without odometry: no motion, as it was moved before
  EXPECT_EQ(tracker.odometry(), (Pose2{50.0, 3.0, 1.0}));
  (void)tracker.observe(picture(8));  // its motion is that from the picture before
  const Pose2 moved = inverse(Pose2{50.0, 3.0, 1.0}) * *tracker.odometry();
  const Pose2 expected = inverse(pose(5)) * pose(8);
  EXPECT_LT(distance(moved.position(), expected.position()), 0.1);
  EXPECT_THROW(tracker.move(std::nullopt, nullptr), ContractError);
}

TEST_F(TrackerTest, PicturesWithoutOdometryAreBridged) {
  const OdometryNoise none{DriveKind::holonomic, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  const Pose2 odometry_from_world{7.0, -4.0, 2.0};
  Tracker tracker(memory(), {.odometry = none});
  tracker.start_at(pose(0), 0.0, 0.0);
  std::vector<DatasetEntry> entries(20);
  for (int i = 0; i < 20; ++i) {  // it begins late, pauses, and ends early
    if (i >= 2 && i != 8 && i != 9 && i < 18)
      entries[static_cast<std::size_t>(i)].odometry = odometry_from_world * pose(i);
  }
  const auto robot = [&] {
    const auto& particles = tracker.localiser().particles();
    return Pose2{particles.x_m[0], particles.y_m[0], 0.0}.position();
  };
  double error_m = 0.0;
  for (int i = 0; i < 20; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const FourierSignature view = tracker.encoder().signature(picture(i));
    const bool is_needed = i <= 10 || i >= 13;  // six images before a pause, and one after
    EXPECT_EQ(tracker.needs_view(entries, n), is_needed) << i;
    tracker.move(entries[n].odometry, is_needed ? &view : nullptr);
    EXPECT_LT(distance(robot(), pose(i).position()), 0.1) << i;
    EXPECT_EQ(tracker.odometry().has_value(), i >= 2);
    if (i == 2) error_m = distance(robot(), pose(i).position());
    // Odometry is cumulative, so that the pause leaves no error.
    if (i >= 10 && i < 18) {
      EXPECT_NEAR(distance(robot(), pose(i).position()), error_m, 0.01) << i;
    }
  }
  EXPECT_EQ(tracker.visual_odometry()->tried_steps(), 2 + 2 + 2);
  EXPECT_EQ(tracker.visual_odometry()->breaks(), 0);
}

TEST_F(TrackerTest, MissingOdometryIsFilledFromThePictures) {
  const Pose2 odometry_from_world{7.0, -4.0, 2.0};
  const std::filesystem::path drive = *folder_ / "drive";
  std::vector<Pose2> poses;
  for (int i = 0; i < 14; ++i) poses.push_back(pose(i));
  write_dataset(drive, world(), poses);
  const Tracker tracker(memory());
  Executor executor;
  for (const std::vector<std::size_t>& missing :
       {std::vector<std::size_t>{0, 1}, {5, 6, 7}, {12, 13}}) {
    Dataset run = read_dataset(drive);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const bool is_missing = std::ranges::find(missing, i) != missing.end();
      if (!is_missing) run.entries[i].odometry = odometry_from_world * poses[i];
    }
    const Dataset before = run;
    (void)add_visual_odometry(run, tracker.memory(), tracker.encoder(), executor);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      ASSERT_TRUE(run.entries[i].odometry);
      if (before.entries[i].odometry) {
        EXPECT_EQ(run.entries[i].odometry, before.entries[i].odometry);
      }
      const Pose2 expected = odometry_from_world * poses[i];
      EXPECT_LT(distance(run.entries[i].odometry->position(), expected.position()), 0.1) << i;
    }
  }
}

TEST_F(TrackerTest, TellsTheFloorOfTheRobot) {
  const std::filesystem::path building = *folder_ / "building.panonav";
  const std::array worlds{world(), landmark_world(8)};
  const std::array<std::string, 2> floors{"ground", "first"};
  {
    Memoriser memoriser(building, {.source = landmark_panoramas()});
    const auto poses = grid_poses(7);
    for (std::size_t f = 0; f < floors.size(); ++f) {
      for (std::size_t i = 0; i < poses.size(); ++i) {
        Observation seen(landmark_picture(worlds[f], poses[i]));
        seen.name = make_name_on_floor(floors[f], view_name(i));
        seen.pose = ReferencePose{poses[i].x_m, poses[i].y_m, 0.0};
        memoriser.add(seen);
      }
    }
    memoriser.finish();
  }
  for (std::size_t f = 0; f < floors.size(); ++f) {
    Tracker tracker(building);
    MonteCarloEstimate last;
    for (int i = 0; i < 20; ++i) {
      Observation seen(landmark_picture(worlds[f], pose(i)));
      seen.odometry = pose(i);
      last = tracker.observe(seen);
    }
    ASSERT_EQ(last.state, LocalisationState::localised);
    EXPECT_EQ(last.floor(), floors[f]);
    EXPECT_EQ(tracker.floor(), floors[f]);
    EXPECT_LT(distance(last.pose->position(), pose(19).position()), 0.25);
    EXPECT_EQ(last.modes.front().mean, *last.pose);
    EXPECT_LT(last.spread_m, 10.0);
    EXPECT_EQ(tracker.posed_views().size(), 49U);
    const Particles on_floor = tracker.particles();
    for (std::size_t i = 0; i < on_floor.size(); ++i) {
      EXPECT_LT(distance(on_floor.position(i), {1.5, 1.5}), 10.0);
    }
    // A start is on the floor where the robot was last.
    tracker.start_at(pose(0), 0.1, 0.1);
    EXPECT_EQ(tracker.particles().size(), tracker.localiser().particles().size());
    const VisualMemory& views = tracker.memory();
    EXPECT_EQ(floor_of(views.info(tracker.find_nearest_view({1.0, 1.0})).name), floors[f]);
  }
}

}  // namespace
}  // namespace panonav::testing
