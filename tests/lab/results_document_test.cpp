#include "lab/reporting/results_document.hpp"
#include "support/text.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace panonav::lab {
using namespace testing;
namespace {

ResultRow row(const std::string& what, double ours, std::optional<Target> target) {
  return {.id = "x." + what,
          .what = what,
          .published = std::nullopt,
          .ours = ours,
          .interval = std::nullopt,
          .unit = "m",
          .target = target};
}

ResultsDocument document() {
  ResultRow missed = row("far_off", 3.0, Target{Comparison::at_most, 1.0});
  missed.reason = "the floor is *wet*";
  return {.version = "1.2.3",
          .command = "panonav reproduce all --quick",
          .papers = {{"a01",
                      "Walking | running",
                      {row("reported", 5.0, std::nullopt), missed,
                       row("kept", 0.5, Target{Comparison::at_most, 1.0})}},
                     {"b02", "Standing", {row("still", 0.0, std::nullopt)}}}};
}

TEST(ResultsDocument, CountsOverAllPapers) {
  EXPECT_EQ(count_targets(document()), (TargetCount{.judged = 2, .held = 1}));
  EXPECT_EQ(count_targets(ResultsDocument{}), TargetCount{});
}

TEST(ResultsDocument, PutsTargetsFirstAndKeepsTheirOrder) {
  auto rows = document().papers[0].rows;
  EXPECT_EQ(move_targets_first(rows), 2U);
  EXPECT_EQ(rows[0].what, "far_off");
  EXPECT_EQ(rows[1].what, "kept");
  EXPECT_EQ(rows[2].what, "reported");
}

TEST(ResultsDocument, JsonHasTheRowsOfEveryPaper) {
  const auto made = document();
  const auto object = nlohmann::json::parse(to_json(made));
  EXPECT_EQ(object["version"], "1.2.3");
  EXPECT_EQ(object["command"], "panonav reproduce all --quick");
  EXPECT_EQ(object["targets"], 2);
  EXPECT_EQ(object["held"], 1);
  ASSERT_EQ(object["papers"].size(), 2U);
  EXPECT_EQ(object["papers"]["a01"], nlohmann::json::parse(to_json(made.papers[0].rows)));
  const auto read = rows_from_json(object["papers"]["a01"].dump(), "x");
  EXPECT_EQ(to_json(read), to_json(made.papers[0].rows));
}

TEST(ResultsDocument, MarkdownHasEveryMissAndThenAllRowsWithATarget) {
  const auto made = document();
  ASSERT_EQ(list_misses(made).size(), 1U);
  EXPECT_EQ(list_misses(made)[0],
            "a01: far_off: 3 m, target at most 1: missed by 2; the floor is *wet*.");
  const std::string text = to_markdown(made);
  EXPECT_EQ(text.rfind("# Results", 0), 0U);
  std::size_t at = 0;
  for (const std::string part :
       {"panonav 1.2.3", "    panonav reproduce all --quick", "1 of 2 targets met",
        "Targets that were not met",
        "- a01: far\\_off: 3 m, target at most 1: missed by 2; the floor is \\*wet\\*.",
        "## Walking \\| running", "| what | published | ours (95 % interval) | unit |",
        "| far\\_off | - | 3 | m | at most 1 | no |\n",
        "| kept | - | 0.5 | m | at most 1 | yes |\n", "## Standing", "No row has a target.\n",
        "`results.json` holds 4 rows, those without a target too.\n"}) {
    const std::size_t found = text.find(part, at);
    ASSERT_NE(found, std::string::npos) << part << " after\n" << text.substr(0, at);
    at = found;
  }
  EXPECT_FALSE(contains(text, "reported")) << "it has no target";
}

TEST(ResultsDocument, MarkdownHoldsAllOfARow) {
  ResultsDocument made = document();
  ResultRow& kept = made.papers[0].rows[2];
  kept.published = std::pair{5.0, 6.0};
  kept.interval = std::pair{0.4, 0.6};
  kept.over = "median of 7";
  EXPECT_TRUE(
      contains(to_markdown(made),
               "| kept (median of 7) | 5 .. 6 | 0.5 (0.4 .. 0.6) | m | at most 1 | yes |\n"));
}

TEST(ResultsDocument, SaysSoWhenNothingIsMissed) {
  ResultsDocument made = document();
  made.papers[0].rows[1].ours = 0.5;
  EXPECT_TRUE(list_misses(made).empty());
  EXPECT_TRUE(contains(to_markdown(made), "## Targets that were not met\n\nNone.\n"));
}

}  // namespace
}  // namespace panonav::lab
