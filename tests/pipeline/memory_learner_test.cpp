#include "panonav/pipeline/memory_learner.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/live_memory.hpp"
#include "support/landmark_pictures.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

PictureSource toy_panoramas() {
  PictureSource source;
  source.layout.elevations = ElevationBand{radians(-20.0), radians(20.0)};
  return source;
}

Observation picture_of(const ToyWorld& world, const Pose2& pose, std::size_t number) {
  Observation seen(world.picture(pose, 96, 12));
  seen.name = "view " + std::to_string(number);
  return seen;
}

class MemoryLearning : public ::testing::Test {
 protected:
  void SetUp() override {
    Memoriser memoriser(path, {.source = toy_panoramas()});
    std::size_t number = 0;
    for (const Pose2& pose : grid_poses(6)) {
      Observation seen = picture_of(world, pose, number++);
      seen.pose = ReferencePose{pose.x_m, pose.y_m, pose.heading_rad};
      memoriser.add(std::move(seen));
    }
    memoriser.finish();
    before.emplace(MemoryFile::open(path, Access::read_only).load());
  }

  /// Along y = 1 m, in which `changed` is seen over half a metre in the middle.
  MemoryLearner::Changes run(const ToyWorld& seen_world, const ToyWorld* changed) {
    const PlaceRecogniser recogniser(path);
    MemoryLearner learner(path);
    for (std::size_t i = 0; i < 21; ++i) {
      const Pose2 pose{0.125 * static_cast<double>(i), 1.05, 0.0};
      const bool is_changed = changed != nullptr && i >= 9 && i < 13;
      Observation seen = picture_of(is_changed ? *changed : seen_world, pose, i);
      seen.odometry = Pose2{-2.0, 7.0, 1.0} * pose;
      const Panorama panorama = recogniser.encoder().panorama(seen);
      learner.see(seen, panorama, recogniser.localise(seen));
    }
    return learner.finish("a run");
  }
  [[nodiscard]] MemoryFile file() const { return MemoryFile::open(path, Access::read_only); }

  TemporaryFolder folder;
  std::filesystem::path path = folder / "m.panonav";
  ToyWorld world = landmark_world(5);
  std::optional<VisualMemory> before;
};

TEST_F(MemoryLearning, WhatHasChangedIsLearntWhereTheRobotWasAndTakenBackAgain) {
  const ToyWorld changed = landmark_world(9);
  const auto changes = run(world, &changed);
  EXPECT_GE(changes.certain, 10U);
  EXPECT_GE(changes.reinforced, 3U);
  ASSERT_GE(changes.added, 1U);
  EXPECT_LE(changes.added, 4U);
  EXPECT_EQ(changes.views, before->size() + changes.added);
  const VisualMemory now = file().load();
  ASSERT_EQ(now.size(), changes.views);
  for (const ViewId view : now.views()) {
    const ReferenceInfo& info = now.info(view);
    if (!info.name.starts_with("learnt 1/")) continue;
    EXPECT_NEAR(info.pose->y_m, 1.05, 0.15);
    EXPECT_NEAR(info.pose->x_m, 1.4, 0.5);
    EXPECT_NEAR(*info.pose->heading_rad, 0.0, 0.1);
    EXPECT_TRUE(file().thumbnail(view));
    EXPECT_TRUE(file().features(view));
  }
  const auto history = file().history();
  ASSERT_EQ(history.size(), 1U);
  EXPECT_EQ(history[0].what, "a run: " + as_text(changes));
  // The next run finds what this one learnt.
  EXPECT_EQ(run(world, &changed).added, 0U);
  ASSERT_EQ(file().history().size(), 2U);
  EXPECT_TRUE(file().verify().empty());

  MemoryFile undoing = MemoryFile::open(path, Access::read_write);
  undoing.undo();
  undoing.undo();
  const VisualMemory again = undoing.load();
  ASSERT_EQ(again.size(), before->size());
  for (const ViewId view : before->views()) {
    EXPECT_EQ(again.info(view), before->info(view));
    EXPECT_EQ(again.packed(view), before->packed(view));
  }
}

TEST_F(MemoryLearning, AnotherBuildingLeavesTheFileAsItIs) {
  const auto changes = run(landmark_world(21), nullptr);
  EXPECT_EQ(changes.seen, 21U);
  EXPECT_EQ(changes.certain, 0U);
  EXPECT_EQ(file().history().size(), 0U);
  EXPECT_EQ(file().parameter("use of views"), std::nullopt);
  EXPECT_EQ(file().load().size(), before->size());
}

TEST_F(MemoryLearning, WithoutOdometryNothingIsSaidAndNothingLearnt) {
  const PlaceRecogniser recogniser(path);
  MemoryLearner learner(path);
  const Observation seen = picture_of(world, {1.0, 1.0, 0.0}, 0);
  learner.see(seen, recogniser.encoder().panorama(seen), recogniser.localise(seen));
  const auto changes = learner.finish("nothing");
  EXPECT_EQ(changes.seen, 0U);
  EXPECT_TRUE(file().history().empty());
}

TEST_F(MemoryLearning, MemoriesWithoutHeadingsAreRefused) {
  {
    MemoryFile bare = MemoryFile::open(path, Access::read_write);
    for (const ViewId view : before->views()) bare.set_pose(view, std::nullopt);
  }
  try {
    const MemoryLearner learner(path);
    FAIL();
  } catch (const FileError& error) {
    EXPECT_TRUE(contains(error.what(), "holds 0 views with position and heading")) << error.what();
  }
}

TEST_F(MemoryLearning, ALiveMemoryKeepsKnownPlacesTrueByOdometry) {
  const ToyWorld changed = landmark_world(9);
  LiveMemory live(path, {.learn = true, .in_step = true, .memoriser = {.source = toy_panoramas()}});
  for (std::size_t i = 0; i < 21; ++i) {
    const Pose2 pose{0.125 * static_cast<double>(i), 1.05, 0.0};
    Observation seen = picture_of(i >= 9 && i < 13 ? changed : world, pose, 100 + i);
    seen.odometry = pose;
    const auto answer = live.answer(seen);
    EXPECT_FALSE(answer.is_new) << i;  // placed at the end, by odometry
    if (answer.is_new) live.learn(std::move(seen));
  }
  const auto changes = live.finish("a walk");
  ASSERT_TRUE(changes);
  EXPECT_GE(changes->added, 1U);
  for (const ViewId view : file().views()) {
    EXPECT_TRUE(file().load().info(view).pose);
  }
}

}  // namespace
}  // namespace panonav::testing
