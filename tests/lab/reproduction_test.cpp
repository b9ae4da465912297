#include "lab/reproduction.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "panonav/core/error.hpp"
#include "support/reproductions.hpp"

namespace panonav::lab {
using namespace testing;
namespace {

using Reproductions = ReproductionTest;

TEST(NavigationReproduction, RefusesTooFewScenesAndRuns) {
  Executor executor(1);
  for (const ReproductionOptions& options :
       {ReproductionOptions{.out = "x", .scenes = 1}, {.out = "x", .scenes = 4, .runs = 3}}) {
    EXPECT_THROW((void)reproduce("navigation", options, executor), ContractError);
  }
}

TEST_F(Reproductions, SignaturesAreTheSameOnOneAndTwoThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  expect_same_on_one_and_two_threads("m04",
                                     {.seed = 5,
                                      .scenes = 2,
                                      .queries = 3,
                                      .rows = 6,
                                      .fine_lattice_every = 0,
                                      .mission_grids = {}},
                                     100, 10);
  EXPECT_GT(times, 0U);
}

TEST_F(Reproductions, TrackingIsTheSameOnOneAndTwoThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  expect_same_on_one_and_two_threads("m03",
                                     {.seed = 705,
                                      .scenes = 1,
                                      .runs = 2,
                                      .rows = 4,
                                      .columns = 64,
                                      .variants = 1,
                                      .only = "office"},
                                     100, 9);
  EXPECT_EQ(times, 0U);
  for (const std::string& id : ids) EXPECT_EQ(id.rfind("m03.", 0), 0U) << id;
  for (const char* const id :
       {"m03.global.clean.none.images", "m03.global.hard.topological.within_10",
        "m03.global.hard.ratio.explained", "m03.tracking.hard.explained.known_before",
        "m03.kidnapped.hard.topological.images", "m03.particles.paper.0.1.within_10"}) {
    EXPECT_TRUE(ids.contains(id)) << id;
  }
}

TEST_F(Reproductions, HomingIsTheSameOnOneAndTwoThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  expect_same_on_one_and_two_threads("s06",
                                     {.seed = 7,
                                      .scenes = 2,
                                      .goals_every = 8,
                                      .goals_every_further = 16,
                                      .spacing_m = 0.1,
                                      .starts = 1},
                                     50, 16);
  EXPECT_GE(judged, 15U);
}

TEST_F(Reproductions, MappingIsTheSameOnOneAndTwoThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  expect_same_on_one_and_two_threads(
      "f11", {.scenes = 2, .runs = 1, .columns = 132, .views = 16, .max_views = 100}, 30, 0);
  for (const char* const id :
       {"f11.loop.published", "f11.loop.published_chosen", "f11.loop.published_fixed.mirror",
        "f11.loop.published_chosen.as_written", "f11.loop.published_heading.true_turns",
        "f11.loop.published_chosen.spacing_40cm", "f11.loop.published_chosen.inside_15cm",
        "f11.loop.sidedness.inside_15cm", "f11.loop.mirror.open", "f11.lab.mirror.closed",
        "f11.lab.published_chosen.mirror_true_lengths", "f11.lab.clearance"}) {
    EXPECT_TRUE(ids.contains(id)) << id;
  }
}

TEST_F(Reproductions, ElsewhereIsTheSameOnOneAndTwoThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  expect_same_on_one_and_two_threads("elsewhere",
                                     {.seed = 7,
                                      .scenes = 2,
                                      .runs = 2,
                                      .queries = 4,
                                      .rows = 20,
                                      .built_in = {"office", "lab"},
                                      .days = 3,
                                      .day_pictures = 12,
                                      .walks = 2,
                                      .walk_pictures = 40},
                                     30, 1);
  for (const char* const id :
       {"elsewhere.places.office.clean.known", "elsewhere.places.lab.radius",
        "elsewhere.places.other", "elsewhere.places.variant", "elsewhere.home.foreign",
        "elsewhere.stated.calibration", "elsewhere.stated.sure", "elsewhere.kidnapped.calibration",
        "elsewhere.home.noise_16", "elsewhere.tilt.lab.3", "elsewhere.tracks.office.ellipse",
        "elsewhere.days.office.with", "elsewhere.days.office.rerecorded",
        "elsewhere.days.office.with.views", "elsewhere.days.office.rounds"}) {
    EXPECT_TRUE(ids.contains(id)) << id;
  }
  EXPECT_TRUE(std::ranges::any_of(
      ids, [](const std::string& id) { return id.starts_with("elsewhere.merge.loop."); }));
}

TEST_F(Reproductions, RoutesAreTheSameOnOneAndTwoThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  ReproductionOptions options = default_options("routes", true);
  options.route_lengths_m = {5.0};
  expect_same_on_one_and_two_threads("routes", options, 50, 0);
  for (const char* const id :
       {"routes.hall.5.snapshot_chain.reached", "routes.hall.5.mushroom_body.bytes",
        "routes.hall.5.min_warping.time", "routes.hall.off.route_panorama.reached",
        "routes.hall.day.SeqSLAM.reached"}) {
    EXPECT_TRUE(ids.contains(id)) << id;
  }
}

TEST_F(Reproductions, RefuseWhatMakesNoSenseAndFoldersThatCannotBeMade) {
  Executor executor(1);
  const auto refuse = [&](const char* paper, auto change) {
    ReproductionOptions options = default_options(paper);
    options.out = folder.path();
    change(options);
    EXPECT_THROW((void)reproduce(paper, options, executor), ContractError) << paper;
  };
  for (const char* const paper : {"f11", "m04", "navigation", "s06", "y03"}) {
    refuse(paper, [](auto& options) { options.scenes = 1; });
  }
  for (const char* const paper : {"m03", "elsewhere"}) {
    refuse(paper, [](auto& options) { options.scenes = 0; });
  }
  for (const char* const paper : {"m03", "y03", "elsewhere"}) {
    refuse(paper, [](auto& options) { options.runs = 1; });
  }
  refuse("m03", [](auto& options) { options.only = "kitchen"; });
  refuse("m04", [](auto& options) { options.fine_lattice_every = -1; });
  refuse("m04", [](auto& options) { options.runs = 3; });
  refuse("m04", [](auto& options) { options.mission_scenes = 0; });
  refuse("s06", [](auto& options) { options.spacing_m = 0.5; });
  EXPECT_THROW((void)default_options("m05"), ContractError);
  for (const char* const paper : {"m03", "m04", "s06"}) {
    ReproductionOptions options = default_options(paper);
    options.out = "/dev/null/folder";
    EXPECT_THROW((void)reproduce(paper, options, executor), FileError);
  }
}

}  // namespace
}  // namespace panonav::lab
