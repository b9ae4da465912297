#include "experiments/reproduction.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include "panonav/core/error.hpp"
#include "support/skips.hpp"

namespace panonav {
namespace {

class ReproductionFolder : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] Reproduction reproduce(int threads) const {
    Executor executor(threads);
    return reproduce_m04({.out = folder_ / std::to_string(threads),
                          .scenes = 2,
                          .queries = 3,
                          .rows = 6,
                          .fine_lattice_every = 0,
                          .mission_grids = {},
                          .seed = 5},
                         executor);
  }
  std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) / ("reproduction." + std::to_string(getpid()));
};

TEST_F(ReproductionFolder, SameSeedSameRowsOnOneAndTwoThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const Reproduction one = reproduce(1);
  const Reproduction two = reproduce(2);
  ASSERT_GT(one.rows.size(), 100U);
  ASSERT_EQ(one.rows.size(), two.rows.size());
  std::set<std::string> ids;
  std::size_t times = 0;
  for (std::size_t i = 0; i < one.rows.size(); ++i) {
    const ResultRow& a = one.rows[i];
    const ResultRow& b = two.rows[i];
    EXPECT_TRUE(ids.insert(a.id).second) << a.id << " stands twice";
    EXPECT_EQ(a.id, b.id);
    EXPECT_TRUE(std::isfinite(a.ours)) << a.id;
    if (a.unit == "ms") {
      ++times;
      EXPECT_GT(a.ours, 0.0) << a.id;
      continue;
    }
    EXPECT_EQ(a.ours, b.ours) << a.id;
    EXPECT_EQ(a.interval, b.interval) << a.id;
    EXPECT_EQ(a.holds(), b.holds()) << a.id;
    if (a.interval) {
      EXPECT_LE(a.interval->first, a.interval->second) << a.id;
    }
  }
  EXPECT_GT(times, 0U);
  for (const auto& picture : one.pictures) {
    EXPECT_TRUE(std::filesystem::is_regular_file(folder_ / "1" / picture.file)) << picture.file;
  }
  EXPECT_GE(one.pictures.size(), 10U);
}

TEST(Reproduction, RefusesOneSceneAndFoldersThatCannotBeMade) {
  Executor executor(1);
  EXPECT_THROW((void)reproduce_m04({.out = ::testing::TempDir(), .scenes = 1}, executor),
               ContractError);
  EXPECT_THROW(
      (void)reproduce_m04({.out = ::testing::TempDir(), .fine_lattice_every = -1}, executor),
      ContractError);
  EXPECT_THROW((void)reproduce_m04({.out = ::testing::TempDir(), .missions = 3}, executor),
               ContractError);
  EXPECT_THROW((void)reproduce_m04({.out = ::testing::TempDir(), .mission_scenes = 0}, executor),
               ContractError);
  EXPECT_THROW((void)reproduce_m04({.out = "/dev/null/folder"}, executor), FileError);
}

}  // namespace
}  // namespace panonav
