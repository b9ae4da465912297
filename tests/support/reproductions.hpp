#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>

#include "lab/reproduction.hpp"
#include "panonav/core/executor.hpp"
#include "support/skips.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {

/// The rows of the experiments of a paper, none of them twice. They run with one and with two
/// threads: rows and images must be the same, to the byte, except those of times.
class ReproductionTest : public InTemporaryFolder {
 protected:
  void expect_same_on_one_and_two_threads(std::string_view paper, lab::ReproductionOptions options,
                                          std::size_t more_rows_than, std::size_t min_pictures) {
    Executor alone(1);
    Executor both(2);
    options.out = folder / "1";
    one = lab::reproduce(paper, options, alone);
    options.out = folder / "2";
    const lab::Reproduction two = lab::reproduce(paper, options, both);
    ASSERT_GT(one.rows.size(), more_rows_than);
    ASSERT_EQ(one.rows.size(), two.rows.size());
    for (std::size_t i = 0; i < one.rows.size(); ++i) {
      const lab::ResultRow& a = one.rows[i];
      const lab::ResultRow& b = two.rows[i];
      EXPECT_TRUE(ids.insert(a.id).second) << a.id << " stands twice";
      EXPECT_EQ(a.id, b.id);
      EXPECT_EQ(a.what, b.what);
      EXPECT_TRUE(std::isfinite(a.ours)) << a.id;
      judged += a.target ? 1 : 0;
      if (a.unit == "ms" || a.unit == "us" || a.unit == "x") {
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
    EXPECT_GE(one.pictures.size(), min_pictures);
    for (const auto& picture : one.pictures) {
      const std::string bytes = bytes_of(folder / "1" / picture.file);
      EXPECT_GT(bytes.size(), 2000U) << picture.file;
      const bool of_times = picture.file.string().find("time") != std::string::npos;
      EXPECT_TRUE(of_times || bytes == bytes_of(folder / "2" / picture.file)) << picture.file;
    }
  }

  lab::Reproduction one;
  std::set<std::string> ids;
  std::size_t judged = 0;  ///< rows with a target
  std::size_t times = 0;
};

}  // namespace panonav::testing
