#include "panonav/pipeline/live_memory.hpp"

#include <gtest/gtest.h>

#include "panonav/core/error.hpp"
#include "panonav_recordings/recording.hpp"
#include "panonav_recordings/run_recorder.hpp"
#include "support/landmark_pictures.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::recordings {
using namespace testing;
namespace {

Observation seen_at(const ToyWorld& world, const Pose2& pose, std::size_t number) {
  Observation seen(landmark_picture(world, pose));
  seen.name = "view " + std::to_string(number);
  seen.stamp_s = 0.5 * static_cast<double>(number);
  seen.pose = ReferencePose{pose.x_m, pose.y_m, pose.heading_rad};
  return seen;
}

/// Answers of a walk over the grid, `add` on, and what a recorder of it left out.
std::vector<bool> walk(const std::filesystem::path& memory, bool in_step, std::size_t& left_out,
                       const std::filesystem::path& record) {
  LiveMemory live(memory, {.add = true,
                           .update = true,
                           .min_interval_s = 0.5,
                           .in_step = in_step,
                           .memoriser = {.source = landmark_panoramas()}});
  RunRecorder recorder(record, {.wait = in_step, .max_waiting = 8});
  const ToyWorld world = landmark_world(5);
  std::vector<bool> known;
  std::size_t number = 0;
  for (int round = 0; round < 2; ++round) {
    for (const Pose2& pose : grid_poses(6)) {
      Observation seen = seen_at(world, pose, number++);
      const auto answer = live.answer(seen);
      known.push_back(answer.place && answer.place->known);
      RunMoment moment{.stamp_s = *seen.stamp_s, .truth = seen.pose};
      if (answer.place) set_localisation(moment, *answer.place);
      recorder.add(std::move(moment));
      if (answer.is_new) live.add(std::move(seen));
    }
  }
  recorder.close();
  left_out = recorder.left_out();
  live.finish();
  EXPECT_EQ(MemoryFile::open(memory, Access::read_only).info().views, live.added());
  return known;
}

TEST(LiveMemory, AddsWhatIsNewAndKnowsItWhenItComesBack) {
  const TemporaryFolder folder;
  std::size_t left_out = 0;
  const auto known = walk(folder / "a.panonav", true, left_out, folder / "a.mcap");
  EXPECT_EQ(left_out, 0U);
  EXPECT_EQ(std::count(known.begin(), known.begin() + 32, true), 0);  // as many begin a memory
  EXPECT_GE(std::count(known.begin() + 36, known.end(), true), 34);
  const auto file = MemoryFile::open(folder / "a.panonav", Access::read_only);
  EXPECT_GE(file.info().views, 32U);
  EXPECT_LE(file.info().views, 40U);
  // In step, the same observations give the same answers.
  EXPECT_EQ(walk(folder / "b.panonav", true, left_out, folder / "b.mcap"), known);
}

TEST(LiveMemory, BesideTheAnswersItStoresAllThatItAddedAndLosesNoMoment) {
  const TemporaryFolder folder;
  std::size_t left_out = 0;
  const auto known = walk(folder / "a.panonav", false, left_out, folder / "a.mcap");
  const auto recording = Recording::open(folder / "a.mcap");
  for (const auto& topic : recording->topics()) {
    if (topic.name == "/tf") {
      EXPECT_EQ(topic.messages + left_out, known.size());
    }
  }
}

TEST(LiveMemory, TheAnsweredPanoramaIsKeptForWhoRecordsItAndIsWhatIsAdded) {
  const TemporaryFolder folder;
  std::size_t left_out = 0;
  walk(folder / "a.panonav", true, left_out, folder / "a.mcap");
  LiveMemory live(folder / "a.panonav", {.add = true,
                                         .update = true,
                                         .min_interval_s = 0.0,
                                         .in_step = false,
                                         .memoriser = {.source = landmark_panoramas()}});
  const Observation elsewhere = seen_at(landmark_world(99), {0.3, 0.4, 0.5}, 1000);
  const auto answer = live.answer(elsewhere);
  ASSERT_TRUE(live.panorama());
  EXPECT_TRUE(*live.panorama() == live.recogniser()->encoder().panorama(elsewhere));
  ASSERT_TRUE(answer.is_new);
  const PackedSignature signature = live.recogniser()->encoder().packed(elsewhere);
  live.add(elsewhere);
  EXPECT_FALSE(live.panorama());
  live.finish();
  const auto file = MemoryFile::open(folder / "a.panonav", Access::read_only);
  const auto view = file.find(elsewhere.name);
  ASSERT_TRUE(view);
  EXPECT_EQ(file.load().packed(*view), signature);
}

TEST(LiveMemory, AViewThatCannotBeStoredIsSaidAtTheLatestAtTheEnd) {
  const TemporaryFolder folder;
  std::size_t left_out = 0;
  walk(folder / "a.panonav", true, left_out, folder / "a.mcap");
  LiveMemory live(folder / "a.panonav", {.add = true,
                                         .update = true,
                                         .min_interval_s = 0.0,
                                         .in_step = false,
                                         .memoriser = {.source = landmark_panoramas()}});
  // Another program has stored another picture under the name.
  Memoriser(folder / "a.panonav").add(seen_at(landmark_world(98), {0.2, 0.1, 0.0}, 1000));
  live.add(seen_at(landmark_world(99), {0.3, 0.4, 0.5}, 1000));
  EXPECT_THROW(live.finish(), FileError);
}

TEST(LiveMemory, WithoutAddingThereMustBeAMemory) {
  const TemporaryFolder folder;
  EXPECT_THROW(LiveMemory(folder / "none.panonav"), FileError);
}

TEST(RunRecorder, WhatCannotBeWrittenIsSaidOnceAndNothingMoreIsTaken) {
  EXPECT_THROW(RunRecorder("/dev/full"), FileError);
  const TemporaryFolder folder;
  RunRecorder recorder(folder / "a.mcap");
  recorder.close();
  recorder.close();
  EXPECT_THROW(recorder.add({}), ContractError);
}

}  // namespace
}  // namespace panonav::recordings
