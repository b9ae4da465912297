// Runs home as rows and pictures.

#include "lab/s06/worlds.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "lab/s06/chains.hpp"
#include "panonav/core/error.hpp"
#include "panonav_simulation/scenes.hpp"
#include "support/skips.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::lab {
using namespace testing;
namespace {

TEST(S06Worlds, EveryEndHasItsReason) {
  HomingRun run;
  run.end = HomingRunEnd::arrived;
  run.end_distance_m = 0.05;
  EXPECT_TRUE(run.is_success(0.1));
  EXPECT_EQ(explain_failure(run), "");
  run.end_distance_m = 0.2;
  EXPECT_EQ(explain_failure(run), "stopped short, 20 cm off");
  std::set<std::string> reasons;
  run.end_distance_m = 0.8;
  for (const auto end : {HomingRunEnd::arrived, HomingRunEnd::wrong_place, HomingRunEnd::blocked,
                         HomingRunEnd::exhausted}) {
    run.end = end;
    EXPECT_FALSE(run.is_success(0.1));
    reasons.insert(explain_failure(run));
  }
  EXPECT_EQ(reasons.size(), 4U);
}

TEST(S06Worlds, AWorldGivesItsRowsAndAPictureOfEachFailure) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const auto scenes = real_data("scenes");
  PANONAV_REQUIRE_DATA(scenes, "scenes");
  const TemporaryFolder out;
  Executor executor(2);
  Reproduction result{.out = out.path()};
  const ReproductionOptions options{.data = scenes->parent_path(), .seed = 5, .starts = 30};
  reproduce_homing_in_world("small_warehouse", {options, executor, result});
  ASSERT_GE(result.rows.size(), 6U);
  EXPECT_EQ(result.rows.front().id, "s06.world.small_warehouse.success");
  EXPECT_GE(result.rows.front().ours, 0.8);
  const auto failures =
      static_cast<std::size_t>(std::lround(30.0 * (1.0 - result.rows.front().ours)));
  EXPECT_EQ(result.pictures.size(), 1U + failures);
  for (const ReproductionPicture& picture : result.pictures) {
    EXPECT_TRUE(std::filesystem::exists(out / picture.file.string())) << picture.file;
  }
}

TEST(S06Worlds, AWorldThatIsNotThereIsAnError) {
  const TemporaryFolder out;
  Executor executor(1);
  Reproduction result{.out = out.path()};
  const ReproductionOptions options{.data = out.path()};
  EXPECT_THROW(reproduce_homing_in_world("nowhere", {options, executor, result}), FileError);
}

TEST(S06Chains, RowsAreTheSameOnAnyNumberOfThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor one(1);
  Executor two(2);
  const HomingPlace place =
      make_homing_place(simulation::make_scene("office"), chain_camera(), two);
  Reproduction a;
  Reproduction b;
  reproduce_snapshot_chains(place, "office", 3, 2, one, a);
  reproduce_snapshot_chains(place, "office", 3, 2, two, b);
  ASSERT_EQ(a.rows.size(), 7U);
  for (std::size_t i = 0; i < a.rows.size(); ++i) EXPECT_EQ(a.rows[i].ours, b.rows[i].ours);
  EXPECT_EQ(a.rows.front().id, "s06.chain.office.completed");
  EXPECT_GE(a.rows.front().ours, 0.75);
}

}  // namespace
}  // namespace panonav::lab
