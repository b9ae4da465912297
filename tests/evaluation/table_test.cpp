#include "panonav/evaluation/table.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

namespace panonav {
namespace {

ResultRow row(double ours, Comparison comparison, double value) {
  return {.id = "a.b",
          .what = "error | at the goal",
          .published = std::pair{5.0, 6.0},
          .ours = ours,
          .interval = std::nullopt,
          .unit = "m",
          .target = Target{comparison, value}};
}

TEST(ResultRow, HoldsWhenTheTargetIsMet) {
  EXPECT_TRUE(row(1.0, Comparison::at_most, 1.0).holds());
  EXPECT_FALSE(row(1.1, Comparison::at_most, 1.0).holds());
  EXPECT_TRUE(row(1.1, Comparison::at_least, 1.0).holds());
  EXPECT_FALSE(row(0.9, Comparison::at_least, 1.0).holds());
  EXPECT_FALSE(row(std::numeric_limits<double>::quiet_NaN(), Comparison::at_most, 1.0).holds());
}

TEST(ResultRow, JsonIsTheDocumentedArray) {
  const std::vector<ResultRow> rows{row(0.5, Comparison::at_most, 1.0)};
  const auto list = nlohmann::json::parse(to_json(rows));
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list[0]["id"], "a.b");
  EXPECT_EQ(list[0]["published"], nlohmann::json::array({5.0, 6.0}));
  EXPECT_EQ(list[0]["target"]["op"], "<=");
  EXPECT_EQ(list[0]["holds"], true);
  EXPECT_TRUE(list[0]["interval"].is_null());
}

TEST(ResultRow, MarkdownKeepsItsColumns) {
  const std::vector<ResultRow> rows{row(2.0, Comparison::at_most, 1.0)};
  const std::string text = to_markdown(rows);
  EXPECT_NE(text.find("error \\| at the goal"), std::string::npos);
  EXPECT_NE(text.find("**no**"), std::string::npos);
}

}  // namespace
}  // namespace panonav
