#include "lab/reporting/table.hpp"
#include "support/text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"

namespace panonav::lab {
using namespace testing;
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

TEST(ResultRow, FiguresAreAsPeopleWriteThem) {
  ResultRow rate = row(0.0, Comparison::at_most, 0.00005);
  rate.interval = std::pair{1.735e-18, 0.0369935};
  EXPECT_EQ(format_figure(rate), "0 (0 .. 0.03699) m");
  EXPECT_EQ(format_target(rate), "at most 0.00005");
  EXPECT_EQ(table_cells(rate)[2], "0 (0 .. 0.03699)");
  rate.ours = -1e-17;
  rate.interval = std::nullopt;
  EXPECT_EQ(format_figure(rate), "0 m");
}

ResultRow missed() {
  ResultRow result = row(2.0, Comparison::at_most, 1.0);
  result.interval = std::pair{1.5, 2.5};
  result.reason = "wheels \"slip\"";
  return result;
}

TEST(ResultRow, ReadsBackWhatItWrites) {
  ResultRow bare = row(0.1, Comparison::at_least, 0.0);  // not exact in binary
  bare.published = std::nullopt;
  bare.target = std::nullopt;
  bare.unit = "";
  ResultRow range = missed();
  range.published = std::pair{-1.0, 1e-300};
  range.over = "median of 7";
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ResultRow nothing = row(nan, Comparison::at_most, 1.0);
  nothing.interval = std::pair{nan, 4.0};
  const std::vector<ResultRow> rows{bare, range, nothing, row(-7.0, Comparison::at_most, 3.0)};
  const auto read = rows_from_json(to_json(rows), "x.json");
  ASSERT_EQ(read.size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(read[i].id, rows[i].id);
    EXPECT_EQ(read[i].what, rows[i].what);
    EXPECT_EQ(read[i].over, rows[i].over);
    EXPECT_EQ(read[i].unit, rows[i].unit);
    EXPECT_EQ(read[i].target, rows[i].target);
    EXPECT_EQ(read[i].reason, rows[i].reason);
    EXPECT_EQ(read[i].holds(), rows[i].holds());
  }
  EXPECT_EQ(read[0].ours, 0.1);
  EXPECT_EQ(read[0].published, std::nullopt);
  EXPECT_EQ(read[1].published, range.published);
  EXPECT_EQ(read[1].interval, range.interval);
  EXPECT_TRUE(std::isnan(read[2].ours));
  ASSERT_TRUE(read[2].interval);
  EXPECT_TRUE(std::isnan(read[2].interval->first));
  EXPECT_EQ(read[2].interval->second, 4.0);
  EXPECT_EQ(to_json(read), to_json(rows));
  EXPECT_TRUE(rows_from_json("[]", "x.json").empty());
}

TEST(ResultRow, AReasonIsToldOnlyWhereTheTargetIsMissed) {
  ResultRow held = missed();
  held.ours = 0.5;
  const std::vector<ResultRow> rows{missed(), held};
  const auto list = nlohmann::json::parse(to_json(rows));
  EXPECT_EQ(list[0]["reason"], "wheels \"slip\"");
  EXPECT_TRUE(list[1]["reason"].is_null());
}

TEST(ResultRow, ReadsRowsOfBeforeReasonsWereTold) {
  auto list = nlohmann::json::parse(to_json(std::vector{missed()}));
  list[0].erase("reason");
  list[0].erase("over");
  const auto read = rows_from_json(list.dump(), "x.json");
  ASSERT_EQ(read.size(), 1U);
  EXPECT_EQ(read[0].reason, "");
  EXPECT_EQ(read[0].over, "");
}

TEST(ResultRow, ReadingNamesFileRowAndField) {
  const auto fault = [](const std::string& text) {
    return message_of<FileError>([&] { (void)rows_from_json(text, "x.json"); });
  };
  EXPECT_TRUE(contains(fault(""), "x.json: is no JSON"));
  EXPECT_TRUE(contains(fault("{}"), "x.json: is no list of rows"));
  EXPECT_TRUE(contains(fault("[7]"), "row 1 is 7; allowed: an object"));
  EXPECT_TRUE(contains(fault(std::string(100000, '[')), "is no JSON"));
  const std::string deep = std::string(100000, '[') + std::string(100000, ']');
  EXPECT_TRUE(contains(fault("[" + deep + "]"), "row 1 is an array"));
  const std::string good = to_json(std::vector{missed(), missed()});
  EXPECT_EQ(fault(good), "no error");
  // Cut anywhere, it is no JSON any more.
  for (std::size_t i = 0; i < good.size() - 2; i += 7) {
    EXPECT_TRUE(contains(fault(good.substr(0, i)), "x.json: is no JSON")) << i;
  }
  for (const std::string field :
       {"id", "what", "published", "ours", "interval", "unit", "target", "holds"}) {
    auto without = nlohmann::json::parse(good);
    without[1].erase(field);
    EXPECT_TRUE(contains(fault(without.dump()), "x.json: row 2: " + field + " is missing"));
    auto other = nlohmann::json::parse(good);
    other[0][field] = nlohmann::json::object({{"a", 1}});
    EXPECT_TRUE(
        contains(fault(other.dump()), "x.json: row 1: " + field + " is an object; allowed: "));
  }
  auto list = nlohmann::json::parse(good);
  list[0]["interval"] = {1.0, 2.0, 3.0};
  EXPECT_TRUE(contains(fault(list.dump()), "interval is an array"));
  list[0]["interval"] = {1.0, "x"};
  EXPECT_TRUE(contains(fault(list.dump()), "interval is an array"));
  list = nlohmann::json::parse(good);
  list[0]["target"]["op"] = "<";
  EXPECT_TRUE(contains(fault(list.dump()), "target is an object"));
  list = nlohmann::json::parse(good);
  list[0]["holds"] = true;
  EXPECT_TRUE(contains(fault(list.dump()), "holds is true; allowed: false"));
  list = nlohmann::json::parse(good);
  list[0]["reason"] = 7;
  EXPECT_TRUE(contains(fault(list.dump()), "reason is 7; allowed: a text"));
  list = nlohmann::json::parse(good);
  list[0]["over"] = 7;
  EXPECT_TRUE(contains(fault(list.dump()), "over is 7; allowed: a text"));
}

TEST(ResultRow, TellsByHowMuchAndWhyItIsMissed) {
  ResultRow one = missed();
  EXPECT_EQ(explain_miss(one), "by 1; wheels \"slip\"");
  one.reason = "";
  EXPECT_EQ(explain_miss(one), "by 1; no reason is known");
  one.interval = std::pair{0.9, 2.5};
  EXPECT_EQ(explain_miss(one), "by 1; the 95 % interval reaches the target");
  one.target = Target{Comparison::at_least, 2.25};
  EXPECT_EQ(explain_miss(one), "by 0.25; the 95 % interval reaches the target");
  one.reason = "it rains";
  EXPECT_EQ(explain_miss(one), "by 0.25; the 95 % interval reaches the target; it rains");
  one.reason = "";
  one.interval = std::pair{0.9, 2.2};
  EXPECT_EQ(explain_miss(one), "by 0.25; no reason is known");
  one.unit = "ms";
  EXPECT_EQ(explain_miss(one), "by 0.25; a time depends on the machine and on its other load");
  one.ours = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(explain_miss(one), "nothing could be measured");
}

TEST(ResultRow, CellsTellWhatTheFigureWasTakenOver) {
  ResultRow one = missed();
  one.over = "median of 7";
  EXPECT_EQ(table_cells(one),
            (std::vector<std::string>{"error | at the goal (median of 7)", "5 .. 6",
                                      "2 (1.5 .. 2.5)", "m", "at most 1", "no"}));
  EXPECT_EQ(table_cells(one).size(), table_header().size());
}

}  // namespace
}  // namespace panonav::lab
