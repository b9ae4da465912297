#include "panonav/pipeline/memory_updater.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/pipeline/internal/learnt_models.hpp"
#include "panonav/pipeline/live_memory.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "support/landmark_pictures.hpp"
#include "support/skips.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

Observation make_observation(const ToyWorld& world, const Pose2& pose, std::size_t number) {
  Observation seen(landmark_picture(world, pose));
  seen.name = "view " + std::to_string(number);
  return seen;
}

/// All of a memory that learning changes, and what it answers.
struct Remembered {
  std::vector<std::tuple<ViewId, ReferenceInfo, PackedSignature>> views;
  std::optional<std::string> use;
  std::vector<std::tuple<double, std::string, double, Point2>> answers;
  friend bool operator==(const Remembered&, const Remembered&) = default;
};

/// Grey levels of chance; `smoothed`: over 8 pixels each way, which leaves things of some size.
Image noise_picture(std::uint64_t seed, bool smoothed) {
  constexpr int rows = 12;
  constexpr int columns = 96;
  Random random(seed);
  std::vector<double> grey(static_cast<std::size_t>(rows) * columns);
  for (double& value : grey) value = random.uniform();
  const int reach = smoothed ? 4 : 0;
  Image image(columns, rows);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      double sum = 0.0;
      int count = 0;
      for (int dy = -reach; dy <= reach; ++dy) {
        if (y + dy < 0 || y + dy >= rows) continue;
        for (int dx = -reach; dx <= reach; ++dx) {
          sum += grey[static_cast<std::size_t>((y + dy) * columns + (x + dx + columns) % columns)];
          ++count;
        }
      }
      const double mean = 0.5 + (sum / count - 0.5) * std::sqrt(count);
      image.at(x, y) = static_cast<std::uint8_t>(255.0 * std::clamp(mean, 0.0, 1.0));
    }
  }
  return image;
}

class MemoryUpdating : public ::testing::Test {
 protected:
  void SetUp() override {
    Memoriser memoriser(path, {.source = landmark_panoramas()});
    std::size_t number = 0;
    for (const Pose2& pose : grid_poses(6)) {
      Observation seen = make_observation(world, pose, number++);
      seen.pose = ReferencePose{pose.x_m, pose.y_m, pose.heading_rad};
      memoriser.add(std::move(seen));
    }
    memoriser.finish();
    before.emplace(MemoryFile::open(path, Access::read_only).load());
  }

  /// Along y = 1 m; `picture` gives what is seen at a pose, by its number.
  MemoryUpdater::Changes run(const std::function<Image(const Pose2&, std::size_t)>& picture,
                             const MemoryUpdateOptions& options = {}) {
    const PlaceRecogniser recogniser(path);
    MemoryUpdater updater(path, options);
    for (std::size_t i = 0; i < 21; ++i) {
      const Pose2 pose{0.125 * static_cast<double>(i), 1.05, 0.0};
      Observation seen(picture(pose, i));
      seen.name = "view " + std::to_string(i);
      seen.odometry = Pose2{-2.0, 7.0, 1.0} * pose;
      const Panorama panorama = recogniser.encoder().panorama(seen);
      updater.observe(seen, panorama, recogniser.localise(seen));
    }
    before_finish();
    return updater.finish("a run");
  }
  /// `changed` is seen over half a metre in the middle.
  MemoryUpdater::Changes run(const ToyWorld& seen_world, const ToyWorld* changed) {
    return run([&](const Pose2& pose, std::size_t i) {
      const bool is_changed = changed != nullptr && i >= 9 && i < 13;
      return landmark_picture(is_changed ? *changed : seen_world, pose);
    });
  }
  [[nodiscard]] Remembered remembered() const {
    Remembered now{.use = file().parameter("use of views")};
    const VisualMemory memory = file().load();
    for (const ViewId view : memory.views()) {
      now.views.emplace_back(view, memory.info(view), memory.packed(view));
    }
    const PlaceRecogniser recogniser(path);
    const std::array worlds{world, landmark_world(9), landmark_world(13), landmark_world(17)};
    for (const ToyWorld& seen : worlds) {
      for (const double x_m : {0.3, 1.2, 1.4}) {
        const Place place = recogniser.localise(landmark_picture(seen, {x_m, 1.0, 0.4}));
        const PlaceMatch& best = place.matches.at(0);
        now.answers.emplace_back(
            place.known_probability, best.name, best.column_difference,
            place.position ? Point2{place.position->x_m, place.position->y_m} : Point2{});
      }
    }
    return now;
  }
  [[nodiscard]] MemoryFile file() const { return MemoryFile::open(path, Access::read_only); }

  std::function<void()> before_finish = [] {};
  TemporaryFolder folder;
  std::filesystem::path path = folder / "m.panonav";
  ToyWorld world = landmark_world(5);
  std::optional<VisualMemory> before;
};

TEST_F(MemoryUpdating, WhatHasChangedIsLearntWhereTheRobotWasAndTakenBackAgain) {
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
    if (!info.name.starts_with("update 1/")) continue;
    EXPECT_NEAR(info.pose->y_m, 1.05, 0.15);
    EXPECT_NEAR(info.pose->x_m, 1.4, 0.5);
    EXPECT_NEAR(*info.pose->heading_rad, 0.0, 0.1);
    EXPECT_TRUE(file().thumbnail(view));
    EXPECT_TRUE(file().features(view));
  }
  const auto history = file().history();
  ASSERT_EQ(history.size(), 1U);
  EXPECT_EQ(history[0].what, "a run: " + summarise(changes));
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

TEST_F(MemoryUpdating, RunByRunViewsAreReplacedAndForgottenAndEachRunCanBeTakenBack) {
  const std::array changed{landmark_world(9), landmark_world(13), landmark_world(17)};
  const MemoryUpdateOptions few{.appearances = 2, .failures = 2};
  std::vector<Remembered> after{remembered()};
  MemoryUpdater::Changes all;
  for (const std::size_t seen : {0U, 0U, 0U, 1U, 2U, 2U, 2U}) {
    SCOPED_TRACE("run " + std::to_string(after.size()));
    // Over more than a metre, so that no picture beside it matches the reference in its middle.
    const auto changes = run(
        [&](const Pose2& pose, std::size_t i) {
          return landmark_picture(i >= 8 && i < 17 ? changed[seen] : world, pose);
        },
        few);
    EXPECT_GE(changes.certain, 10U);
    all.added += changes.added;
    all.replaced += changes.replaced;
    all.forgotten += changes.forgotten;
    after.push_back(remembered());
    EXPECT_EQ(after.back().views.size(), changes.views);
    EXPECT_EQ(changes.views, before->size() + all.added - all.replaced - all.forgotten);
    EXPECT_LE(changes.views, 2 * before->size());
    const auto history = file().history();
    ASSERT_EQ(history.size(), after.size() - 1);
    EXPECT_EQ(history[0].what, "a run: " + summarise(changes));
  }
  EXPECT_GE(all.replaced, 1U);
  EXPECT_GE(all.forgotten, 1U);
  EXPECT_TRUE(file().verify().empty());
  while (after.size() > 1) {
    SCOPED_TRACE("run " + std::to_string(after.size() - 1) + " taken back");
    EXPECT_NE(after.back(), after[after.size() - 2]) << "the run did nothing";
    after.pop_back();
    MemoryFile::open(path, Access::read_write).undo();
    EXPECT_EQ(remembered(), after.back());
    EXPECT_EQ(file().history().size(), after.size() - 1);
  }
  EXPECT_TRUE(file().verify().empty());
}

TEST_F(MemoryUpdating, AKillWhileARunIsStoredLeavesTheFileAsBeforeOrAfterIt) {
  const ToyWorld changed = landmark_world(9);
  const std::filesystem::path kept = folder / "before.panonav";
  std::filesystem::copy_file(path, kept);
  const Remembered untouched = remembered();
  const auto now = [] { return std::chrono::steady_clock::now(); };
  auto begun = now();
  before_finish = [&] { begun = now(); };
  ASSERT_GE(run(world, &changed).added, 1U);
  const auto duration = std::chrono::duration_cast<std::chrono::microseconds>(now() - begun);
  const Remembered learnt = remembered();
  ASSERT_NE(learnt, untouched);
  Random random(23);
  constexpr int kills = 12;
  for (int round = 0; round < kills; ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    for (const char* suffix : {"", "-wal", "-shm"}) {
      std::filesystem::remove(path.string() + suffix);
    }
    std::filesystem::copy_file(kept, path);
    std::array<int, 2> ends{};
    ASSERT_EQ(::pipe(ends.data()), 0);
    const auto tell = [&] { return ::write(ends[1], "!", 1) == 1; };
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      before_finish = [&] { (void)tell(); };
      try {
        run(world, &changed);
        (void)tell();
        for (;;) ::pause();
      } catch (...) {
      }
      std::_Exit(1);
    }
    ::close(ends[1]);
    char said = 0;
    ASSERT_EQ(::read(ends[0], &said, 1), 1) << "the run ended by itself";
    const bool stored = round == kills - 1;
    if (stored) {
      ASSERT_EQ(::read(ends[0], &said, 1), 1) << "the run ended by itself";
    } else {
      std::this_thread::sleep_for(
          std::chrono::microseconds(random.index(static_cast<std::size_t>(duration.count()))));
    }
    ASSERT_EQ(::kill(child, SIGKILL), 0);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ::close(ends[0]);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the run ended by itself";
    EXPECT_TRUE(file().verify().empty());
    const Remembered left = remembered();
    EXPECT_TRUE(left == learnt || (!stored && left == untouched));
    EXPECT_EQ(file().history().size(), left == learnt ? 1U : 0U);
    EXPECT_TRUE(load_stored_models(file(), file().load())) << "the models are of other views";
  }
}

TEST_F(MemoryUpdating, NoiseAndAnotherBuildingLeaveTheFileAsItIs) {
  const Remembered untouched = remembered();
  const ToyWorld elsewhere = landmark_world(21);
  const std::array<std::function<Image(const Pose2&, std::size_t)>, 4> pictures{
      [](const Pose2&, std::size_t i) { return noise_picture(100 + i, false); },
      [](const Pose2&, std::size_t i) { return noise_picture(200 + i, true); },
      // The same noise throughout, as of a lens with dirt on it.
      [](const Pose2&, std::size_t) { return noise_picture(300, true); },
      [&](const Pose2& pose, std::size_t) { return landmark_picture(elsewhere, pose); }};
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    SCOPED_TRACE(i);
    const auto changes = run(pictures[i]);
    EXPECT_EQ(changes.observations, 21U);
    EXPECT_EQ(changes.certain, 0U);
    EXPECT_TRUE(file().history().empty());
    EXPECT_EQ(remembered(), untouched);
  }
}

TEST_F(MemoryUpdating, NoiseInTheMidstOfARunDropsNothingAndHasNoAnswersOfItsOwn) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const Remembered untouched = remembered();
  std::size_t runs = 0;
  for (const bool smoothed : {false, true}) {
    SCOPED_TRACE(smoothed);
    for (std::uint64_t times = 0; times < 6; ++times, ++runs) {
      const auto changes = run([&](const Pose2& pose, std::size_t i) {
        return i >= 9 && i < 13 ? noise_picture(1000 * times + i, smoothed)
                                : landmark_picture(world, pose);
      });
      EXPECT_EQ(changes.forgotten, 0U);
    }
    // Views that were never matched again make room for what is new, and for nothing else.
    const VisualMemory now = file().load();
    for (const ViewId view : before->views()) {
      ASSERT_TRUE(now.contains(view));
      EXPECT_EQ(now.packed(view), before->packed(view));
    }
    EXPECT_LE(now.size(), before->size() + runs) << "one a run, of four images of noise";
    const PlaceRecogniser recogniser(path);
    for (std::uint64_t seed = 50'000; seed < 50'020; ++seed) {
      EXPECT_FALSE(recogniser.localise(noise_picture(seed, smoothed)).known) << seed;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const double x_m = std::array{0.3, 1.2, 1.4}[i];
      const Place place = recogniser.localise(landmark_picture(world, {x_m, 1.0, 0.4}));
      ASSERT_TRUE(place.known);
      EXPECT_NEAR(place.position->x_m, x_m, 0.25);
      EXPECT_NEAR(place.position->y_m, 1.0, 0.25);
    }
    MemoryFile undoing = MemoryFile::open(path, Access::read_write);
    while (undoing.undoable()) undoing.undo();
    EXPECT_EQ(remembered(), untouched);
  }
}

TEST_F(MemoryUpdating, WithoutOdometryNothingIsSaidAndNothingLearnt) {
  const PlaceRecogniser recogniser(path);
  MemoryUpdater updater(path);
  const Observation seen = make_observation(world, {1.0, 1.0, 0.0}, 0);
  updater.observe(seen, recogniser.encoder().panorama(seen), recogniser.localise(seen));
  const auto changes = updater.finish("nothing");
  EXPECT_EQ(changes.observations, 0U);
  EXPECT_TRUE(file().history().empty());
  EXPECT_THROW((void)updater.finish("nothing"), ContractError);
  EXPECT_THROW(
      updater.observe(seen, recogniser.encoder().panorama(seen), recogniser.localise(seen)),
      ContractError);
}

TEST_F(MemoryUpdating, MemoriesWithoutHeadingsAreRefused) {
  {
    MemoryFile bare = MemoryFile::open(path, Access::read_write);
    for (const ViewId view : before->views()) bare.set_pose(view, std::nullopt);
  }
  try {
    const MemoryUpdater updater(path);
    FAIL();
  } catch (const FileError& error) {
    EXPECT_TRUE(contains(error.what(), "holds 0 views with position and heading")) << error.what();
  }
}

TEST_F(MemoryUpdating, ALiveMemoryKeepsKnownPlacesTrueByOdometry) {
  const ToyWorld changed = landmark_world(9);
  LiveMemory live(path, {.add = true,
                         .update = true,
                         .in_step = true,
                         .memoriser = {.source = landmark_panoramas()}});
  for (std::size_t i = 0; i < 21; ++i) {
    const Pose2 pose{0.125 * static_cast<double>(i), 1.05, 0.0};
    Observation seen = make_observation(i >= 9 && i < 13 ? changed : world, pose, 100 + i);
    seen.odometry = pose;
    const auto answer = live.answer(seen);
    EXPECT_FALSE(answer.is_new) << i;  // placed at the end, by odometry
    if (answer.is_new) live.add(std::move(seen));
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
