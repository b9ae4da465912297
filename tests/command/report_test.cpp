#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "support/command_runner.hpp"
#include "support/report_pages.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Pictures in the page, which needs nothing but itself.
int readable_pictures(const fs::path& folder) {
  const std::string page = bytes_of(folder / "index.html");
  (void)text_of_page(page);
  return static_cast<int>(pictures_of(page));
}

std::size_t count_of(const std::string& page, const std::string& text) {
  std::size_t count = 0;
  for (std::size_t at = page.find(text); at != std::string::npos; at = page.find(text, at + 1)) {
    ++count;
  }
  return count;
}

/// Four pictures at the top, then the whole story in its order, each part with an entry at the top
/// that leads to it.
void expect_eight_parts(const fs::path& folder) {
  const std::string page = bytes_of(folder / "index.html");
  const std::string first_screen = page.substr(0, page.find("<nav"));
  EXPECT_EQ(count_of(first_screen, "<section><h2><a href=\"#part"), 4U);
  EXPECT_TRUE(contains(first_screen, "panonav memorise place.panonav photos")) << "how to use it";
  EXPECT_GE(count_of(first_screen, "<img "), 1U);
  EXPECT_EQ(count_of(first_screen, "<pn-plan>"), 3U);
  std::size_t at = page.find("</nav>");
  ASSERT_NE(at, std::string::npos);
  int number = 0;
  for (const char* title : {"Camera", "Localisation", "Adjustable accuracy", "Tracking", "Maps",
                            "Homing", "Routes", "Navigation"}) {
    const std::string part = std::to_string(++number);
    EXPECT_LT(page.find("<a href=\"#part" + part + "\">"), page.find("</nav>")) << title;
    const std::string heading = "<h2 id=\"part" + part + "\">" + part + ". " + title + "</h2>";
    at = page.find(heading, at);
    EXPECT_NE(at, std::string::npos) << heading;
  }
  EXPECT_FALSE(contains(page, "#part9"));
}

/// A command of the page as a user would type it.
CommandResult run_from_page(const fs::path& folder, const std::string& verb) {
  const std::string page = bytes_of(folder / "index.html");
  const std::string begin = "\npanonav " + verb + " ";
  const std::size_t at = page.find(begin);
  EXPECT_NE(at, std::string::npos) << verb;
  std::istringstream line(page.substr(at + 1, page.find('\n', at + 1) - at - 1));
  std::vector<std::string> words{std::istream_iterator<std::string>(line), {}};
  words.erase(words.begin());
  return run_panonav(words);
}

/// Checks the results of the tracked and the navigating robots, on a 50 cm grid.
void expect_tracked_and_navigated(const json& said) {
  EXPECT_EQ(said["track_images"], 55);
  EXPECT_GE(said["track_places_at_first"].get<int>(), 4) << "the corridor's plan is symmetric";
  ASSERT_TRUE(said["track_until_localised"].is_number()) << said;
  EXPECT_GE(said["track_until_localised"].get<int>(), 2);
  ASSERT_TRUE(said["track_until_found_again"].is_number()) << said;
  EXPECT_GE(said["track_localised"].get<int>(), 10);
  EXPECT_LE(said["track_wrong"].get<int>(), 8);
  EXPECT_LT(said["track_error_m"].get<double>(), 0.2);
  EXPECT_EQ(said["missions"], 3);
  EXPECT_GE(said["missions_arrived"].get<int>(), 2);
  EXPECT_LT(said["mission_detour"].get<double>(), 2.5);
  EXPECT_GE(said["mission_steps"].get<double>(), 2.0);
  for (const char* key : {"mission_kidnapped", "mission_screen"}) {
    const json& run = said[key];
    if (run.is_null()) continue;  // no screen leaves a way round
    const std::string end = run["end"];
    EXPECT_TRUE(end == "arrived" || end == "blocked" || end == "lost" || end == "unreachable");
    if (end == "arrived") {
      EXPECT_LE(run["goal_distance_m"].get<double>(), 0.25) << run;
    }
    EXPECT_GE(run["steps"].get<int>(), 1);
  }
}

using Demo = InTemporaryFolder;

TEST_F(Demo, TellsTheWholeStoryTwiceAndLeavesAMemoryThatAnswers) {
  const std::string out = folder / "demo";
  const auto said = answer_of({"demo", "-o", out, "--quick", "--json"});
  EXPECT_EQ(said["report"], out + "/index.html");
  EXPECT_GE(said["views"].get<int>(), 30);
  EXPECT_EQ(said["questions"], 8);
  // A 50 cm grid: the answers must be far better than its nearest view, and elsewhere unknown.
  EXPECT_LT(said["position_error_m"].get<double>(), 0.2);
  EXPECT_LT(said["heading_error_rad"].get<double>(), 0.05);
  EXPECT_GE(said["known"].get<double>(), 0.7);
  EXPECT_LE(said["known_elsewhere"].get<double>(), 0.1);
  EXPECT_EQ(said["runs_home"], 3);
  EXPECT_GE(said["arrived_home"].get<int>(), 2);
  EXPECT_GE(readable_pictures(out), 5);
  expect_eight_parts(out);
  expect_tracked_and_navigated(said);
  const auto log = lines(bytes_of(fs::path(out) / "mission.log"));
  EXPECT_GT(log.size(), said["mission_kidnapped"]["steps"].get<std::size_t>());
  for (const auto& entry : fs::directory_iterator(out)) {
    const std::string kind = entry.path().extension();
    EXPECT_TRUE(kind != ".svg" && kind != ".png") << entry.path() << ": the page holds all images";
  }
  const std::string played = bytes_of(fs::path(out) / "index.html");
  EXPECT_EQ(count_of(played, "<pn-run>"), 3U) << "tracking, the route and the first mission";
  EXPECT_TRUE(contains(played, "\"state\":\"localised\""));
  EXPECT_TRUE(contains(played, "\"state\":\"on the route\""));
  EXPECT_TRUE(contains(played, "\"state\":\"arrived\""));
  EXPECT_TRUE(contains(played, "views in groups")) << "the arrangement unfolds";
  // The page states lengths and how they were measured.
  const std::string page = bytes_of(fs::path(out) / "index.html");
  EXPECT_TRUE(std::regex_search(page, std::regex("Maps</small><b>[0-9]+ cm</b>")));
  EXPECT_FALSE(contains(page, "difference of the shapes"));
  EXPECT_LT(said["arranged_procrustes_disparity"].get<double>(), 0.2);
  EXPECT_LT(said["drive_procrustes_disparity"].get<double>(), 0.1);
  EXPECT_EQ(said["route_runs"], 2);

  const auto memory = answer_of({"info", out + "/office.panonav", "--json"});
  EXPECT_EQ(memory["kind"], "mirror");
  EXPECT_EQ(memory["views"], said["views"]);
  EXPECT_TRUE(memory["elevations_rad"].is_array());
  EXPECT_NE(memory["full_scale"], 1.0);
  const auto result =
      run_panonav({"localise", out + "/office.panonav", out + "/query_run", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(lines(result.out).size(), 8U);
  run_well({"localise", out + "/office.panonav", out + "/memory_run"});

  const auto tracked = run_from_page(out, "track");
  EXPECT_EQ(tracked.exit_code, 0) << tracked.err;
  const auto sent = run_from_page(out, "navigate");
  EXPECT_EQ(sent.exit_code, 0) << sent.out << sent.err;
  EXPECT_TRUE(contains(sent.out, "the memory's lattice"));

  // Again: its own files are written again, the user's stay.
  std::ofstream(fs::path(out) / "notes.txt") << "mine";
  const auto again = run_panonav({"demo", "-o", out, "--quick", "--json"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  auto second = json::parse(again.out);
  second["seconds"] = said["seconds"];
  EXPECT_EQ(second, said) << "the same seed tells another story";
  EXPECT_EQ(bytes_of(fs::path(out) / "notes.txt"), "mine");
}

TEST_F(Demo, TouchesNoFolderThatIsNotItsOwn) {
  std::ofstream(folder / "index.html") << "mine";
  expect_refusal({"demo", "-o", folder.path(), "--quick"}, "not made by panonav demo");
  EXPECT_EQ(bytes_of(folder / "index.html"), "mine");
  const std::string below = folder / "index.html/demo";
  expect_refusal({"demo", "-o", below, "--quick"}, below);
  expect_refusal({"demo", "-o", folder / "new", "--seed", "x"}, "--seed is 'x'");
  EXPECT_FALSE(fs::exists(folder / "new"));
}

using Reproduce = InTemporaryFolder;

TEST_F(Reproduce, WritesTheTableThreeTimesAndAllPictures) {
  const std::string out = folder / "m04";
  const auto rows = answer_of(
      {"reproduce", "m04", "--quick", "--queries", "4", "--rows", "20", "-o", out, "--json"});
  ASSERT_GE(rows.size(), 20U);
  int judged = 0;
  for (const auto& row : rows) {
    for (const char* key :
         {"id", "what", "published", "ours", "interval", "unit", "target", "holds", "reason"}) {
      EXPECT_TRUE(row.contains(key)) << row;
    }
    if (row["target"].is_null()) continue;
    ++judged;
    const double ours = row["ours"];
    const double target = row["target"]["value"];
    EXPECT_EQ(row["holds"], row["target"]["op"] == "<=" ? ours <= target : ours >= target) << row;
  }
  EXPECT_GE(judged, 5);
  EXPECT_EQ(json::parse(bytes_of(fs::path(out) / "results.json")), rows);
  EXPECT_GT(bytes_of(fs::path(out) / "results.md").size(), 500U);
  EXPECT_GE(readable_pictures(out), 5);
}

TEST_F(Reproduce, RefusesBadInput) {
  expect_refusal({"reproduce", "m99", "-o", folder / "x"}, "PAPER is 'm99'; allowed: f11");
  EXPECT_FALSE(fs::exists(folder / "x"));
  std::ofstream(folder / "file") << "mine";
  expect_refusal({"reproduce", "m04", "--quick", "-o", folder / "file/x"}, "file/x");
  expect_refusal({"reproduce", "m04", "--scenes", "1"}, "--scenes is '1'");
  expect_refusal({"reproduce", "m04", "--only", "office"}, "--only cannot be used with m04");
  expect_refusal({"reproduce", "y03", "--queries", "3"}, "--queries cannot be used with y03");
  expect_refusal({"reproduce", "y03", "--scenes", "1"}, "allowed for y03: from 2");
  expect_refusal({"reproduce", "y03", "--quick", "-o", folder / "file/x"}, "file/x");
  expect_refusal({"reproduce", "m03", "--queries", "3"}, "--queries cannot be used with m03");
  expect_refusal({"reproduce", "m03", "--data", folder / "nowhere"}, "no such folder");
  expect_refusal({"reproduce", "m03", "--only", "kitchen"}, "--only");
  expect_refusal({"reproduce", "m04", "--sead", "3"}, "--sead");
}

}  // namespace
}  // namespace panonav::testing
