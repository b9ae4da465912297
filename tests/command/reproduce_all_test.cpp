#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/command_runner.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const std::vector<std::string> papers{"f11", "m03", "m04",       "navigation",
                                      "s06", "y03", "elsewhere", "routes"};

void write(const fs::path& path, const json& value) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << value;
}

// A folder in which every paper is finished; the rows are made up.
class ReproduceAll : public ::testing::Test {
 protected:
  ReproduceAll() {
    std::string version = run_panonav({"--version"}).out;
    version = lines(version).at(0).substr(std::string("panonav ").size());
    write(out_ / "run.json", {{"version", version},
                              {"quick", true},
                              {"seed", 7},
                              {"scenes", nullptr},
                              {"queries", nullptr},
                              {"runs", nullptr},
                              {"rows", nullptr},
                              {"optics", nullptr},
                              {"data", fs::canonical(folder_.path()).string()}});
    for (const std::string& paper : papers) {
      write(out_ / paper / "results.json",
            {row(paper, "told", nullptr), row(paper, "judged", 1.0)});
    }
    auto missed = row("m04", "missed", 0.25);
    missed["holds"] = false;
    missed["reason"] = "the floor is wet";
    write(out_ / "m04/results.json", {row("m04", "told", nullptr), missed});
  }

  static json row(const std::string& paper, const std::string& name, const json& at_most) {
    json target;
    if (!at_most.is_null()) target = {{"op", "<="}, {"value", at_most}};
    return {{"id", paper + "." + name}, {"what", name + " in " + paper},
            {"published", nullptr},     {"ours", 0.5},
            {"interval", {0.4, 0.6}},   {"unit", "m"},
            {"target", target},         {"holds", true}};
  }

  [[nodiscard]] std::vector<std::string> command(const std::vector<std::string>& more) const {
    return with({"reproduce", "all", "-o", out_, "--quick", "--data", folder_.path()}, more);
  }
  [[nodiscard]] std::vector<std::string> continued() const {
    return command({"--seed", "7", "--continue"});
  }

  // Puts a file where an experiment makes its folder.
  void cannot_be_run(const std::string& paper) const {
    fs::remove_all(out_ / paper);
    fs::create_symlink(folder_ / "nowhere/at all", out_ / paper);
  }

  TemporaryFolder folder_;
  fs::path out_ = folder_ / "out";
};

TEST_F(ReproduceAll, WritesOneTableOfWhatIsFinished) {
  auto arguments = continued();
  const auto people = run_panonav(arguments);
  ASSERT_EQ(people.exit_code, 0) << people.err;
  EXPECT_TRUE(contains(people.out, "m04: 0 of 1 targets met (finished by an earlier run)"));
  EXPECT_TRUE(contains(people.out,
                       "missed in m04: 0.5 (0.4 .. 0.6) m, target at most 0.25: missed by "
                       "0.25; the floor is wet."));
  EXPECT_TRUE(contains(people.out, "7 of 8 targets met"));
  const std::string markdown = bytes_of(out_ / "results.md");
  EXPECT_EQ(markdown.rfind("# Results", 0), 0U);
  EXPECT_TRUE(contains(markdown, "panonav reproduce all --quick --seed 7 --data DATA\n"));
  EXPECT_FALSE(contains(markdown, folder_.path().string())) << "a path of this machine";
  const std::string page = bytes_of(out_ / "index.html");
  for (const std::string& paper : papers) {
    EXPECT_FALSE(contains(markdown, "told in " + paper)) << "it has no target";
    EXPECT_TRUE(contains(markdown, (paper == "m04" ? "missed in " : "judged in ") + paper));
    EXPECT_TRUE(contains(page, "href=\"" + paper + "/index.html\""));
  }
  // Machines are given one document, the same that is written.
  arguments.emplace_back("--json");
  const auto document = answer_of(arguments);
  EXPECT_EQ(document, json::parse(bytes_of(out_ / "results.json")));
  EXPECT_EQ(document["targets"], 8);
  EXPECT_EQ(document["held"], 7);
  ASSERT_EQ(document["papers"].size(), papers.size());
  EXPECT_EQ(document["papers"]["m04"][1]["reason"], "the floor is wet");
  EXPECT_EQ(bytes_of(out_ / "results.md"), markdown) << "another table of the same rows";
}

TEST_F(ReproduceAll, RunsWhatIsNotFinishedAndKeepsTheRest) {
  cannot_be_run("m03");
  std::ofstream(out_ / "results.json") << "of an earlier table";
  const std::string run = bytes_of(out_ / "run.json");
  const std::string kept = bytes_of(out_ / "y03/results.json");
  expect_refusal(continued(), "m03: cannot be created");
  EXPECT_FALSE(fs::exists(out_ / "results.json")) << "an old table beside new rows";
  EXPECT_EQ(bytes_of(out_ / "y03/results.json"), kept);
  EXPECT_EQ(bytes_of(out_ / "run.json"), run);
}

TEST_F(ReproduceAll, BeginsAnewWithoutContinue) {
  cannot_be_run("f11");
  expect_refusal(command({"--seed", "8"}), "f11: cannot be created");
  EXPECT_EQ(json::parse(bytes_of(out_ / "run.json"))["seed"], 8);
  for (const std::string& paper : papers) {
    EXPECT_FALSE(fs::exists(out_ / paper / "results.json")) << paper;
  }
}

TEST_F(ReproduceAll, KeepsAnEarlierRunWhenTheOptionsAreBad) {
  expect_refusal(command({"--scenes", "1"}), "--scenes is '1'; allowed for all: from 2");
  expect_refusal({"reproduce", "all", "-o", out_, "--data", folder_ / "nowhere"}, "no such folder");
  EXPECT_EQ(json::parse(bytes_of(out_ / "run.json"))["seed"], 7);
  EXPECT_TRUE(fs::exists(out_ / "f11/results.json"));
}

TEST_F(ReproduceAll, RefusesToContinueARunOfOtherOptions) {
  expect_refusal(command({"--continue"}), "has seed 7, this run null; allowed: the same");
  expect_refusal(command({"--seed", "7", "--runs", "4", "--continue"}), "has runs null");
  expect_refusal(
      {"reproduce", "all", "-o", out_, "--seed", "7", "--data", folder_.path(), "--continue"},
      "has quick true, this run false");
  json run = json::parse(bytes_of(out_ / "run.json"));
  run["version"] = "0.0.1";
  write(out_ / "run.json", run);
  expect_refusal(continued(), "has version \"0.0.1\"");
  run["version"] = json::array();
  write(out_ / "run.json", run);
  expect_refusal(continued(), "run.json: version is an array");
  run.erase("version");
  write(out_ / "run.json", run);
  expect_refusal(continued(), "run.json: version is missing");
  std::ofstream(out_ / "run.json") << "{";
  expect_refusal(continued(), "run.json: is not a complete JSON object");
  fs::remove(out_ / "run.json");
  expect_refusal(continued(), "run.json: does not exist");
  EXPECT_TRUE(fs::exists(out_ / "y03/results.json"));
}

TEST_F(ReproduceAll, RefusesDamagedResultsAndWhatHasNoMeaning) {
  json rows = json::parse(bytes_of(out_ / "s06/results.json"));
  rows[1]["ours"] = "much";
  write(out_ / "s06/results.json", rows);
  expect_refusal(continued(), "s06/results.json: row 2: ours is \"much\"; allowed: ");
  expect_refusal(command({"--only", "office"}), "--only cannot be used with all");
  expect_refusal({"reproduce", "m04", "--quick", "-o", folder_ / "x", "--continue"},
                 "--continue cannot be used with m04");
}

}  // namespace
}  // namespace panonav::testing
