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
  EXPECT_THROW((void)reproduce_navigation({.out = "x", .scenes = 1}, executor), ContractError);
  EXPECT_THROW((void)reproduce_navigation({.out = "x", .scenes = 4, .runs = 3}, executor),
               ContractError);
}

TEST_F(Reproductions, SignaturesAreTheSameOnOneAndTwoThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const auto reproduce = [](const std::filesystem::path& out, Executor& executor) {
    return reproduce_m04({.out = out,
                          .scenes = 2,
                          .queries = 3,
                          .rows = 6,
                          .fine_lattice_every = 0,
                          .mission_grids = {},
                          .seed = 5},
                         executor);
  };
  expect_same_on_one_and_two_threads(reproduce, 100, 10);
  EXPECT_GT(times, 0U);
}

TEST_F(Reproductions, TrackingIsTheSameOnOneAndTwoThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const auto reproduce = [](const std::filesystem::path& out, Executor& executor) {
    return reproduce_m03({.out = out,
                          .scenes = 1,
                          .variants = 1,
                          .runs = 2,
                          .rows = 4,
                          .columns = 64,
                          .seed = 705,
                          .only = "office"},
                         executor);
  };
  expect_same_on_one_and_two_threads(reproduce, 100, 9);
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
  const auto reproduce = [](const std::filesystem::path& out, Executor& executor) {
    return reproduce_s06({.out = out,
                          .scenes = 2,
                          .goals_every = 8,
                          .goals_every_further = 16,
                          .spacing_m = 0.1,
                          .seed = 7,
                          .starts = 1},
                         executor);
  };
  expect_same_on_one_and_two_threads(reproduce, 50, 16);
  EXPECT_GE(judged, 15U);
}

TEST_F(Reproductions, MappingIsTheSameOnOneAndTwoThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const auto reproduce = [](const std::filesystem::path& out, Executor& executor) {
    return reproduce_f11(
        {.out = out, .scenes = 2, .runs = 1, .views = 16, .max_views = 100, .columns = 132},
        executor);
  };
  expect_same_on_one_and_two_threads(reproduce, 30, 0);
}

TEST_F(Reproductions, ElsewhereIsTheSameOnOneAndTwoThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const auto reproduce = [](const std::filesystem::path& out, Executor& executor) {
    return reproduce_elsewhere({.out = out,
                                .built_in = {"office", "lab"},
                                .scenes = 2,
                                .queries = 4,
                                .runs = 2,
                                .rows = 20,
                                .days = 3,
                                .day_pictures = 12,
                                .walks = 2,
                                .walk_pictures = 40,
                                .seed = 7},
                               executor);
  };
  expect_same_on_one_and_two_threads(reproduce, 30, 1);
  for (const char* const id :
       {"elsewhere.places.office.clean.known", "elsewhere.places.lab.radius",
        "elsewhere.places.other", "elsewhere.places.variant", "elsewhere.home.foreign",
        "elsewhere.home.noise_16", "elsewhere.tilt.lab.3", "elsewhere.tracks.office.ellipse",
        "elsewhere.days.office.with", "elsewhere.days.office.rerecorded",
        "elsewhere.days.office.with.views", "elsewhere.days.office.rounds"}) {
    EXPECT_TRUE(ids.contains(id)) << id;
  }
  EXPECT_TRUE(std::ranges::any_of(
      ids, [](const std::string& id) { return id.starts_with("elsewhere.merge.loop."); }));
}

TEST_F(Reproductions, RefuseWhatMakesNoSenseAndFoldersThatCannotBeMade) {
  Executor executor(1);
  const auto out = folder.path();
  EXPECT_THROW((void)reproduce_m03({.out = out, .scenes = 0}, executor), ContractError);
  EXPECT_THROW((void)reproduce_m03({.out = out, .runs = 1}, executor), ContractError);
  EXPECT_THROW((void)reproduce_m03({.out = out, .only = "kitchen"}, executor), ContractError);
  EXPECT_THROW((void)reproduce_m03({.out = "/dev/null/folder"}, executor), FileError);
  EXPECT_THROW((void)reproduce_m04({.out = out, .scenes = 1}, executor), ContractError);
  EXPECT_THROW((void)reproduce_m04({.out = out, .fine_lattice_every = -1}, executor),
               ContractError);
  EXPECT_THROW((void)reproduce_m04({.out = out, .missions = 3}, executor), ContractError);
  EXPECT_THROW((void)reproduce_m04({.out = out, .mission_scenes = 0}, executor), ContractError);
  EXPECT_THROW((void)reproduce_m04({.out = "/dev/null/folder"}, executor), FileError);
  EXPECT_THROW((void)reproduce_s06({.out = out, .scenes = 1}, executor), ContractError);
  EXPECT_THROW((void)reproduce_s06({.out = out, .spacing_m = 0.5}, executor), ContractError);
  EXPECT_THROW((void)reproduce_s06({.out = "/dev/null/folder"}, executor), FileError);
  EXPECT_THROW((void)reproduce_f11({.out = out, .scenes = 1}, executor), ContractError);
  EXPECT_THROW((void)reproduce_y03({.out = out, .scenes = 1}, executor), ContractError);
  EXPECT_THROW((void)reproduce_y03({.out = out, .runs = 1}, executor), ContractError);
}

}  // namespace
}  // namespace panonav::lab
