// Runs of a robot and what a filter makes of them: bookkeeping by hand, then one small office.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "lab/runs/tracking_filter.hpp"
#include "lab/runs/tracking_run.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/pipeline/visual_motion.hpp"
#include "panonav_simulation/mapping_run.hpp"
#include "support/skips.hpp"

namespace panonav::lab {
namespace {

TrackedRun run_with_errors(const std::vector<double>& errors_m) {
  TrackedRun run;
  for (const double error : errors_m) {
    TrackedImage image;
    image.step = run.size();
    image.answered = true;
    image.error_m = error;
    run.push_back(image);
  }
  return run;
}

TEST(TrackedRun, CountsImagesUntilTheErrorStaysBelow) {
  const TrackedRun run = run_with_errors({2.0, 0.1, 0.9, 0.2, 0.1});
  EXPECT_EQ(images_until_localised(run, 0.25), 4);
  EXPECT_EQ(images_until_first_fix(run, 0.25), 2);
  EXPECT_EQ(images_until_localised(run, 0.25, 2), 2) << "counted from step 2 on";
  EXPECT_EQ(images_until_localised(run, 3.0), 1);
  EXPECT_EQ(images_until_localised(run_with_errors({0.1, 0.1, 0.3}), 0.25), std::nullopt)
      << "the last one is not below";
  EXPECT_EQ(images_until_first_fix(run_with_errors({0.3, 0.25}), 0.25), std::nullopt);
  EXPECT_EQ(images_until_localised({}, 0.25), std::nullopt);
}

TEST(TrackedRun, NoAnswerIsNeverRightAndOnlySureAnswersAreConfidentlyWrong) {
  TrackedRun run = run_with_errors({0.1, 0.1, 5.0});
  run[1].answered = false;
  EXPECT_EQ(images_until_localised(run, 6.0), 3);
  EXPECT_FALSE(run[2].is_confidently_wrong(1.0));
  run[2].state = LocalisationState::localised;
  EXPECT_TRUE(run[2].is_confidently_wrong(1.0));
  EXPECT_FALSE(run[2].is_confidently_wrong(5.0));
  run[2].error_m = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(run[2].is_confidently_wrong(5.0));
}

TrackingRun straight_run(Point2 from, int steps) {
  std::vector<Pose2> poses;
  for (int i = 0; i < steps; ++i) poses.push_back({from.x_m + 0.5 * i, from.y_m, 0.0});
  return make_tracking_run(poses, std::vector<PackedSignature>(poses.size()));
}

TEST(TrackingRun, StepsLeadFromPoseToPose) {
  const std::vector<Pose2> poses{{1.0, 2.0, 0.5}, {1.3, 2.4, -2.0}, {0.0, 0.0, 3.0}};
  const TrackingRun run = make_tracking_run(poses, std::vector<PackedSignature>(3));
  ASSERT_EQ(run.steps.size(), 3U);
  EXPECT_FALSE(run.steps[0].moved);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Pose2 reached = run.steps[i - 1].truth * run.steps[i].moved.value();
    EXPECT_NEAR(reached.x_m, poses[i].x_m, 1e-12);
    EXPECT_NEAR(reached.y_m, poses[i].y_m, 1e-12);
    EXPECT_NEAR(reached.heading_rad, poses[i].heading_rad, 1e-12);
  }
  EXPECT_THROW((void)make_tracking_run(poses, std::vector<PackedSignature>(2)), ContractError);
}

TEST(TrackingRun, IsCarriedAwayUnnoticedAndFarEnough) {
  const TrackingRun before = straight_run({0.0, 0.0}, 10);
  const TrackingRun after = straight_run({0.0, 0.0}, 10);
  const auto run = make_kidnapped_run(before, after, 3, 1.5, 4);  // at 1.0 when it is taken
  ASSERT_TRUE(run);
  ASSERT_EQ(run->steps.size(), 3U + 5U);
  EXPECT_EQ(run->steps[3].truth.x_m, 2.5) << "the first place 1.5 m from x = 1";
  EXPECT_FALSE(run->steps[3].moved);
  EXPECT_TRUE(run->steps[2].moved);
  EXPECT_TRUE(run->steps[4].moved);
  EXPECT_FALSE(make_kidnapped_run(before, after, 3, 1.5, 6)) << "only five steps are left";
  EXPECT_FALSE(make_kidnapped_run(before, after, 3, 50.0, 1));
  EXPECT_FALSE(make_kidnapped_run(before, after, 11, 0.1, 1));
}

TEST(TrackingRun, IsKidnappedBetweenPiecesThatWereReordered) {
  const TrackingRun run = straight_run({0.0, 0.0}, 22);
  Random random(5);
  const TrackingRun shuffled = shuffle_pieces(run, 4, random);
  ASSERT_EQ(shuffled.steps.size(), 20U) << "the last two are no whole piece";
  std::size_t kidnapped = 0;
  std::vector<double> positions;
  for (std::size_t i = 0; i < shuffled.steps.size(); ++i) {
    positions.push_back(shuffled.steps[i].truth.x_m);
    const bool continues = i > 0 && positions[i] - positions[i - 1] == run.steps[1].truth.x_m;
    EXPECT_EQ(shuffled.steps[i].moved.has_value(), continues) << i;
    kidnapped += i > 0 && !continues ? 1 : 0;
  }
  EXPECT_GE(kidnapped, 2U);
  std::ranges::sort(positions);
  for (std::size_t i = 0; i < positions.size(); ++i)
    EXPECT_EQ(positions[i], run.steps[i].truth.x_m) << "each once";
  EXPECT_THROW((void)shuffle_pieces(run, 8, random), ContractError);
  EXPECT_THROW((void)shuffle_pieces(run, 0, random), ContractError);
}

TEST(TrackingRun, GoesBlindForAStretch) {
  const TrackingRun run = drop_images(straight_run({0.0, 0.0}, 6), 2, 3);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(run.steps[i].view.has_value(), i < 2 || i > 4) << i;
    EXPECT_EQ(run.steps[i].moved.has_value(), i > 0) << i;
  }
}

TEST(Tracking, FindsTheRobotInAnOfficeTheSameOnAnyNumberOfThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor two(2);
  Executor one(1);
  const simulation::PlaceRecording place = simulation::record_place(
      {.scene = "office", .seed = 701, .spacing_m = 0.5, .queries = 1, .rows = 24, .columns = 128},
      two);
  const auto remembered = make_tracking_place(place, two);
  ASSERT_GE(remembered->memory().size(), 30U);
  EXPECT_EQ(remembered->reference_positions().size(), remembered->memory().size());
  const WalkOptions walks{.variants = 1, .runs_each = 6, .images = 12, .seed = 4};
  const auto clean = record_walks(place, *remembered, make_clean_condition(), walks, two);
  const auto again = record_walks(place, *remembered, make_clean_condition(), walks, one);
  ASSERT_EQ(clean.size(), 6U);
  ASSERT_EQ(again.size(), 6U);
  for (std::size_t r = 0; r < clean.size(); ++r) {
    ASSERT_EQ(clean[r].steps.size(), again[r].steps.size());
    for (std::size_t i = 0; i < clean[r].steps.size(); ++i) {
      EXPECT_EQ(clean[r].steps[i].truth, again[r].steps[i].truth);
      EXPECT_TRUE(*clean[r].steps[i].view == *again[r].steps[i].view);
      EXPECT_TRUE(place.free_space->is_free(clean[r].steps[i].truth.position()));
    }
  }
  const SingleImages single = localise_single_images(*remembered, clean, two);
  EXPECT_GT(single.images, 50U);
  EXPECT_LE(single.right, single.near);
  EXPECT_GT(2 * single.right, single.images);
  const auto setting = compass_setting(InjectionMethod::explained);
  const auto tracked = track_runs(*remembered, clean, setting, 5, two);
  const auto repeated = track_runs(*remembered, clean, setting, 5, one);
  std::size_t found = 0;
  for (std::size_t r = 0; r < tracked.size(); ++r) {
    ASSERT_EQ(tracked[r].size(), repeated[r].size());
    for (std::size_t i = 0; i < tracked[r].size(); ++i) {
      EXPECT_EQ(tracked[r][i].error_m, repeated[r][i].error_m);
      EXPECT_EQ(tracked[r][i].state, repeated[r][i].state);
      EXPECT_LE(tracked[r][i].nearest_mode_m, tracked[r][i].error_m);
      EXPECT_EQ(tracked[r][i].particles, static_cast<int>(remembered->memory().size()));
    }
    found += tracked[r].back().error_m < 0.5 ? 1 : 0;
  }
  EXPECT_GE(found, 5U) << "of 6 runs";
}

TEST(Tracking, HardRunsSeeAChangedOfficeThatStaysTheSameForMoreRuns) {
  Executor two(2);
  const simulation::PlaceRecording place = simulation::record_place(
      {.scene = "office", .seed = 702, .spacing_m = 0.5, .queries = 1, .rows = 8, .columns = 64},
      two);
  const auto remembered = make_tracking_place(place, two);
  WalkOptions walks{.variants = 1, .runs_each = 1, .images = 4, .seed = 4};
  const auto clean = record_walks(place, *remembered, make_clean_condition(), walks, two);
  const auto hard = record_walks(place, *remembered, make_hard_condition(), walks, two);
  ASSERT_TRUE(hard[0].steps[0].view && clean[0].steps[0].view);
  EXPECT_FALSE(*hard[0].steps[0].view == *clean[0].steps[0].view);
  walks.runs_each = 2;
  const auto more = record_walks(place, *remembered, make_hard_condition(), walks, two);
  ASSERT_EQ(more.size(), 2U);
  EXPECT_TRUE(*more[0].steps[0].view == *hard[0].steps[0].view);
  EXPECT_FALSE(more[1].steps[0].truth == more[0].steps[0].truth);
  walks.variants = 0;
  EXPECT_THROW((void)record_walks(place, *remembered, make_hard_condition(), walks, two),
               ContractError);
}

// One iteration shortens displacements as long as the spacing of the references, which makes the
// scale 1.4 to 1.5 times too large in these scenes.
TEST(ScaleOfAMemory, HoldsForStepsShorterThanTheSpacing) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor executor(2);
  for (const char* const scene : {"loop", "lab"}) {
    const auto place = simulation::record_place(
        {.scene = scene, .spacing_m = 0.5, .queries = 1, .rows = 40, .columns = 256}, executor);
    VisualOdometry motion = visual_odometry(make_memory_of_references(place, executor));
    const auto truth = simulation::drive(place, {}, 0.15, 60);
    std::vector<double> ratios;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const Panorama view = simulation::capture_view(place, truth[i], 100 + i);
      const auto step = motion.add(OdometryView(compute_signature(preprocess(view, {}), 15)));
      if (!step || step->views > 1) continue;
      ratios.push_back(distance({}, step->before_from_after.position()) /
                       distance(truth[i - 1].position(), truth[i].position()));
    }
    ASSERT_GT(ratios.size(), 50U);
    EXPECT_NEAR(median(ratios), 1.0, 0.25) << scene;
  }
}

}  // namespace
}  // namespace panonav::lab
