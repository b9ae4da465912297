#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "command_runner.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// Every picture that the page shows is there and can be read; gives their number.
int readable_pictures(const fs::path& folder) {
  const std::string page = bytes_of(folder / "index.html");
  EXPECT_NE(page.find("</html>"), std::string::npos);
  EXPECT_EQ(page.find("http"), std::string::npos) << "the page needs the network";
  EXPECT_EQ(page.find("nan"), std::string::npos);
  const std::regex source("<img src=\"([^\"]+)\"");
  int count = 0;
  for (std::sregex_iterator i(page.begin(), page.end(), source), end; i != end; ++i) {
    const Image picture = read_image(folder / (*i)[1].str());
    EXPECT_GE(picture.width(), 200);
    ++count;
  }
  return count;
}

TEST(Demo, TellsTheWholeStoryTwiceAndLeavesAMemoryThatAnswers) {
  const TemporaryFolder folder;
  const auto out = folder / "demo";
  const auto first = run_panonav({"demo", "-o", out, "--quick", "--json"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto said = json::parse(first.out);
  EXPECT_EQ(said["report"], out + "/index.html");
  EXPECT_GE(said["views"].get<int>(), 30);
  EXPECT_EQ(said["questions"], 10);
  // A 50 cm grid: the answers must be far better than its nearest view, and elsewhere unknown.
  EXPECT_LT(said["position_error_m"].get<double>(), 0.2);
  EXPECT_LT(said["heading_error_rad"].get<double>(), 0.05);
  EXPECT_GE(said["known"].get<double>(), 0.7);
  EXPECT_LE(said["known_elsewhere"].get<double>(), 0.1);
  EXPECT_EQ(said["runs_home"], 3);
  EXPECT_GE(said["arrived_home"].get<int>(), 2);
  EXPECT_EQ(readable_pictures(out), 12);
  EXPECT_LT(said["arranged_shape_difference"].get<double>(), 0.2);
  EXPECT_LT(said["drive_shape_difference"].get<double>(), 0.1);
  EXPECT_EQ(said["route_runs"], 2);

  const auto info = run_panonav({"info", out + "/office.panonav", "--json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  const auto memory = json::parse(info.out);
  EXPECT_EQ(memory["kind"], "mirror");
  EXPECT_EQ(memory["views"], said["views"]);
  EXPECT_TRUE(memory["elevations_rad"].is_array());
  EXPECT_NE(memory["full_scale"], 1.0);
  const auto asked =
      run_panonav({"localise", out + "/office.panonav", out + "/query_run", "--json"});
  EXPECT_EQ(asked.exit_code, 0) << asked.err;
  EXPECT_EQ(lines(asked.out).size(), 10U);
  EXPECT_EQ(run_panonav({"localise", out + "/office.panonav", out + "/memory_run"}).exit_code, 0);

  // Again: its own files are written anew, the user's stay.
  std::ofstream(fs::path(out) / "notes.txt") << "mine";
  const auto again = run_panonav({"demo", "-o", out, "--quick", "--json"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  auto second = json::parse(again.out);
  second["seconds"] = said["seconds"];
  EXPECT_EQ(second, said) << "the same seed tells another story";
  EXPECT_EQ(bytes_of(fs::path(out) / "notes.txt"), "mine");
}

TEST(Demo, TouchesNoFolderThatIsNotItsOwn) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "index.html") << "mine";
  const auto line = refusal({"demo", "-o", folder.path(), "--quick"});
  EXPECT_NE(line.find("not made by panonav demo"), std::string::npos) << line;
  EXPECT_EQ(bytes_of(folder.path() / "index.html"), "mine");
  const auto below = folder / "index.html/demo";
  EXPECT_NE(refusal({"demo", "-o", below, "--quick"}).find(below), std::string::npos);
  EXPECT_NE(refusal({"demo", "-o", folder / "new", "--seed", "x"}).find("--seed is 'x'"),
            std::string::npos);
  EXPECT_FALSE(fs::exists(folder / "new"));
}

TEST(Reproduce, WritesTheTableThreeTimesAndAllPictures) {
  const TemporaryFolder folder;
  const auto out = folder / "m04";
  const auto result = run_panonav(
      {"reproduce", "m04", "--quick", "--queries", "4", "--rows", "20", "-o", out, "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto rows = json::parse(result.out);
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
    const double wanted = row["target"]["value"];
    EXPECT_EQ(row["holds"], row["target"]["op"] == "<=" ? ours <= wanted : ours >= wanted) << row;
  }
  EXPECT_GE(judged, 5);
  EXPECT_EQ(json::parse(bytes_of(fs::path(out) / "results.json")), rows);
  EXPECT_GT(bytes_of(fs::path(out) / "results.md").size(), 500U);
  EXPECT_GE(readable_pictures(out), 5);
}

TEST(Reproduce, RefusesBadInput) {
  const TemporaryFolder folder;
  EXPECT_NE(refusal({"reproduce", "m99", "-o", folder / "x"}).find("PAPER is 'm99'; allowed: f11"),
            std::string::npos);
  EXPECT_FALSE(fs::exists(folder / "x"));
  std::ofstream(folder.path() / "file") << "mine";
  EXPECT_NE(refusal({"reproduce", "m04", "--quick", "-o", folder / "file/x"}).find("file/x"),
            std::string::npos);
  EXPECT_NE(refusal({"reproduce", "m04", "--scenes", "1"}).find("--scenes is '1'"),
            std::string::npos);
  EXPECT_NE(refusal({"reproduce", "m04", "--only", "office"}).find("--only has no meaning for m04"),
            std::string::npos);
  EXPECT_NE(
      refusal({"reproduce", "y03", "--queries", "3"}).find("--queries has no meaning for y03"),
      std::string::npos);
  EXPECT_NE(refusal({"reproduce", "y03", "--scenes", "1"}).find("allowed for y03: from 2"),
            std::string::npos);
  EXPECT_NE(refusal({"reproduce", "y03", "--quick", "-o", folder / "file/x"}).find("file/x"),
            std::string::npos);
  EXPECT_NE(refusal({"reproduce", "m03", "--queries", "3"}).find("--queries has no meaning"),
            std::string::npos);
  EXPECT_NE(refusal({"reproduce", "m03", "--data", folder / "nowhere"}).find("no such folder"),
            std::string::npos);
  EXPECT_NE(refusal({"reproduce", "m03", "--only", "kitchen"}).find("--only"), std::string::npos);
  EXPECT_NE(refusal({"reproduce", "m04", "--sead", "3"}).find("--sead"), std::string::npos);
}

}  // namespace
}  // namespace panonav::testing
