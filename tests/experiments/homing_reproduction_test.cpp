#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "experiments/reproduction.hpp"
#include "panonav/core/error.hpp"
#include "support/skips.hpp"

namespace panonav {
namespace {

class HomingReproduction : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] Reproduction reproduce(int threads) const {
    Executor executor(threads);
    return reproduce_s06({.out = folder_ / std::to_string(threads),
                          .scenes = 2,
                          .goals_every = 8,
                          .goals_every_further = 16,
                          .spacing_m = 0.1,
                          .seed = 7,
                          .starts = 1},
                         executor);
  }
  std::filesystem::path folder_ = std::filesystem::path(::testing::TempDir()) /
                                  ("homing_reproduction." + std::to_string(getpid()));
};

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST_F(HomingReproduction, SameRowsAndPicturesOnOneAndTwoThreads) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const Reproduction one = reproduce(1);
  const Reproduction two = reproduce(2);
  ASSERT_GT(one.rows.size(), 50U);
  ASSERT_EQ(one.rows.size(), two.rows.size());
  std::size_t judged = 0;
  for (std::size_t i = 0; i < one.rows.size(); ++i) {
    EXPECT_EQ(one.rows[i].id, two.rows[i].id);
    judged += one.rows[i].target ? 1 : 0;
    EXPECT_EQ(std::ranges::count_if(one.rows,
                                    [&](const ResultRow& row) { return row.id == one.rows[i].id; }),
              1)
        << one.rows[i].id;
    if (one.rows[i].unit == "us" || one.rows[i].unit == "x") continue;
    EXPECT_TRUE(std::isfinite(one.rows[i].ours)) << one.rows[i].id;
    EXPECT_EQ(one.rows[i].ours, two.rows[i].ours) << one.rows[i].id;
    EXPECT_EQ(one.rows[i].interval, two.rows[i].interval) << one.rows[i].id;
  }
  EXPECT_GE(judged, 15U);
  ASSERT_GE(one.pictures.size(), 16U);
  for (const auto& picture : one.pictures) {
    const std::string bytes = bytes_of(folder_ / "1" / picture.file);
    EXPECT_GT(bytes.size(), 2000U) << picture.file;
    EXPECT_EQ(bytes, bytes_of(folder_ / "2" / picture.file)) << picture.file;
  }
}

TEST_F(HomingReproduction, RefusesWhatMakesNoSense) {
  Executor executor(1);
  EXPECT_THROW((void)reproduce_s06({.out = folder_, .scenes = 1}, executor), ContractError);
  EXPECT_THROW((void)reproduce_s06({.out = folder_, .spacing_m = 0.5}, executor), ContractError);
  EXPECT_THROW((void)reproduce_s06({.out = "/dev/null/folder"}, executor), FileError);
}

}  // namespace
}  // namespace panonav
