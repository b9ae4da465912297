#include "panonav_viewer/moment_json.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <string>

#include "panonav_viewer/page.hpp"
#include "support/viewer_peer.hpp"

namespace panonav::viewer {
namespace {

TEST(MomentJson, HoldsWhatIsKnownWhateverItIs) {
  recordings::RunMoment moment{.stamp_s = std::numeric_limits<double>::quiet_NaN()};
  EXPECT_EQ(json::parse(moment_to_json(moment, 3)), json::parse(R"({"n": 3, "t": null})"));
  moment = moment_at(1.25);
  moment.pose->x_m = std::numeric_limits<double>::infinity();
  moment.covariance = std::array{1.0, 2.0, 0.0, 2.0, 5.0, 0.0, 0.0, 0.0, 9.0};
  moment.truth = ReferencePose{1.00004, 2.0, std::nullopt};
  moment.values = {{"a \"name\"\n</script>", "\xff\xfe"}, {"event", "one"}, {"event", "two"}};
  const json parsed = json::parse(moment_to_json(moment, 0));
  EXPECT_EQ(parsed["pose"], json::parse("[null, 2.0, 0.5]"));
  EXPECT_EQ(parsed["covariance"], json::parse("[1.0, 2.0, 5.0]"));
  EXPECT_EQ(parsed["truth"], json::parse("[1.0, 2.0, null]"));
  EXPECT_EQ(parsed["values"]["a \"name\"\n</script>"], "\uFFFD\uFFFD");
  EXPECT_EQ(parsed["values"]["event"], "one, two");
  EXPECT_EQ(moment_to_json(moment, 0).find('\n'), std::string::npos);  // one line of an event
  EXPECT_EQ(retained_to_json(moment), "");
}

TEST(MomentJson, TellsModesComparisonsAndStages) {
  recordings::RunMoment moment{.stamp_s = 0.0};
  moment.modes = {{.weight = 0.75, .mean = {1.0, 2.0, 0.5}}, {.weight = 0.25}};
  moment.modes[0].covariance = {1.0, 2.0, 0.0, 2.0, 5.0, 0.0, 0.0, 0.0, 9.0};
  moment.comparisons = {{7, 100}, {2, 4'000'000'000U}};
  moment.homing = recordings::RunHoming{1.5, std::numeric_limits<double>::quiet_NaN()};
  moment.stages_ms = {{"reading", 1.25}, {"filter", 0.5}};
  const json parsed = json::parse(moment_to_json(moment, 0));
  EXPECT_EQ(parsed["modes"], json::parse("[[0.75, 1.0, 2.0, 0.5, 1.0, 2.0, 5.0],"
                                         "[0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]"));
  EXPECT_EQ(parsed["compared"], json::parse("[7, 100, 2, 4000000000]"));
  EXPECT_EQ(parsed["homing"], json::parse("[1.5, null]"));
  EXPECT_EQ(parsed["stages"], json::parse(R"({"reading": 1.25, "filter": 0.5})"));
}

TEST(MomentJson, TellsWhatStays) {
  recordings::RunMoment moment{.stamp_s = 0.0};
  moment.references = {{1.0, 2.0}, {3.0, 4.0}};
  moment.reference_views = {{"a\xff", 0.5}, {"b", std::nullopt}};
  moment.regions = {{{{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}, 3}};
  moment.walls = {{{0.0, 0.0}, {5.0, 0.0}}};
  const json parsed = json::parse(retained_to_json(moment));
  EXPECT_EQ(parsed["names"], json::parse(R"(["a\ufffd", "b"])"));
  EXPECT_EQ(parsed["headings"], json::parse("[0.5, null]"));
  EXPECT_EQ(parsed["regions"], json::parse("[[3, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]]"));
  EXPECT_EQ(parsed["walls"], json::parse("[[0.0, 0.0, 5.0, 0.0]]"));
  // Other references without names have not those of the ones before.
  RetainedParts retained;
  retained.update_from(moment);
  recordings::RunMoment later{.stamp_s = 1.0};
  later.references = {{5.0, 6.0}};
  retained.update_from(later);
  const json kept = json::parse(retained_to_json(retained.moment));
  EXPECT_EQ(kept["references"], json::parse("[5.0, 6.0]"));
  EXPECT_FALSE(kept.contains("names"));
  EXPECT_EQ(kept["walls"], parsed["walls"]);
}

TEST(Page, NeedsNothingFromElsewhere) {
  const std::string page = live_page("<b>\"run\" & {{style}}", true);
  EXPECT_LE(page.size(), 120'000U);
  EXPECT_NE(page.find("<title>&lt;b&gt;&quot;run&quot; &amp; {{style}}</title>"),
            std::string::npos);
  EXPECT_NE(page.find("panonav/main"), std::string::npos);
  RunPage over("run", 2);
  over.add(moment_at(0.0));
  recordings::RunMoment hostile = moment_at(1.0);
  hostile.values = {{"picture", "</script><script>alert(1)</script>"}};
  over.add(hostile);
  const std::string played = over.html();
  EXPECT_EQ(played.find("<script>alert"), std::string::npos);
  const std::string marked = "<script type=\"application/json\">";
  const std::size_t begin = played.find(marked) + marked.size();
  const json run = json::parse(played.substr(begin, played.find("</script>", begin) - begin));
  ASSERT_EQ(run["moments"].size(), 2U);
  EXPECT_EQ(run["moments"][1]["values"]["picture"], hostile.values[0].second);
  for (const std::string elsewhere : {"http:", "https:", "src=\"", "@import", "url(", "//www"}) {
    EXPECT_EQ(page.find(elsewhere), std::string::npos) << elsewhere;
    EXPECT_EQ(played.find(elsewhere), std::string::npos) << elsewhere;
  }
}

}  // namespace
}  // namespace panonav::viewer
