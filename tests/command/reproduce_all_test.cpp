#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "command_runner.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const std::vector<std::string> papers{"f11", "m03", "m04", "navigation", "s06", "y03"};

json read_json(const fs::path& path) {
  std::ifstream in(path);
  return json::parse(in);
}

std::string read_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

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

  [[nodiscard]] std::vector<std::string> command(std::vector<std::string> more) const {
    std::vector<std::string> all{"reproduce", "all",    "-o",          out_,
                                 "--quick",   "--data", folder_.path()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  [[nodiscard]] std::vector<std::string> continued() const {
    return command({"--seed", "7", "--continue"});
  }

  // What an experiment cannot make its folder of.
  void cannot_be_run(const std::string& paper) const {
    fs::remove_all(out_ / paper);
    fs::create_symlink(folder_.path() / "nowhere/at all", out_ / paper);
  }

  TemporaryFolder folder_;
  fs::path out_ = folder_.path() / "out";
};

TEST_F(ReproduceAll, WritesOneTableOfWhatIsFinished) {
  auto arguments = continued();
  const auto people = run_panonav(arguments);
  ASSERT_EQ(people.exit_code, 0) << people.err;
  EXPECT_NE(people.out.find("m04: 0 of 1 targets hold (finished by an earlier run)"),
            std::string::npos);
  EXPECT_NE(people.out.find("missed in m04: 0.5 (0.4 .. 0.6) m, target at most 0.25: missed by "
                            "0.25; the floor is wet."),
            std::string::npos);
  EXPECT_NE(people.out.find("5 of 6 targets hold"), std::string::npos);
  const std::string markdown = read_text(out_ / "results.md");
  EXPECT_EQ(markdown.rfind("# Results", 0), 0U);
  EXPECT_NE(markdown.find("panonav reproduce all --quick --seed 7 --data DATA\n"),
            std::string::npos);
  EXPECT_EQ(markdown.find(folder_.path().string()), std::string::npos) << "a path of this machine";
  const std::string page = read_text(out_ / "index.html");
  for (const std::string& paper : papers) {
    EXPECT_EQ(markdown.find("told in " + paper), std::string::npos) << "it has no target";
    EXPECT_NE(markdown.find((paper == "m04" ? "missed in " : "judged in ") + paper),
              std::string::npos);
    EXPECT_NE(page.find("href=\"" + paper + "/index.html\""), std::string::npos);
  }
  // Machines are given one document, the same that is written.
  arguments.emplace_back("--json");
  const auto machines = run_panonav(arguments);
  ASSERT_EQ(machines.exit_code, 0) << machines.err;
  const json document = json::parse(machines.out);
  EXPECT_EQ(document, read_json(out_ / "results.json"));
  EXPECT_EQ(document["targets"], 6);
  EXPECT_EQ(document["held"], 5);
  ASSERT_EQ(document["papers"].size(), papers.size());
  EXPECT_EQ(document["papers"]["m04"][1]["reason"], "the floor is wet");
  EXPECT_EQ(read_text(out_ / "results.md"), markdown) << "another table of the same rows";
}

TEST_F(ReproduceAll, RunsWhatIsNotFinishedAndKeepsTheRest) {
  cannot_be_run("m03");
  std::ofstream(out_ / "results.json") << "of an earlier table";
  const std::string run = read_text(out_ / "run.json");
  const std::string kept = read_text(out_ / "y03/results.json");
  const std::string line = refusal(continued());
  EXPECT_NE(line.find("m03: cannot be made"), std::string::npos) << line;
  EXPECT_FALSE(fs::exists(out_ / "results.json")) << "an old table beside new rows";
  EXPECT_EQ(read_text(out_ / "y03/results.json"), kept);
  EXPECT_EQ(read_text(out_ / "run.json"), run);
}

TEST_F(ReproduceAll, BeginsAnewWithoutContinue) {
  cannot_be_run("f11");
  const std::string line = refusal(command({"--seed", "8"}));
  EXPECT_NE(line.find("f11: cannot be made"), std::string::npos) << line;
  EXPECT_EQ(read_json(out_ / "run.json")["seed"], 8);
  for (const std::string& paper : papers) {
    EXPECT_FALSE(fs::exists(out_ / paper / "results.json")) << paper;
  }
}

TEST_F(ReproduceAll, KeepsAnEarlierRunWhenTheOptionsAreBad) {
  EXPECT_NE(refusal(command({"--scenes", "1"})).find("--scenes is '1'; allowed for all: from 2"),
            std::string::npos);
  EXPECT_NE(refusal({"reproduce", "all", "-o", out_, "--data", folder_ / "nowhere"})
                .find("no such folder"),
            std::string::npos);
  EXPECT_EQ(read_json(out_ / "run.json")["seed"], 7);
  EXPECT_TRUE(fs::exists(out_ / "f11/results.json"));
}

TEST_F(ReproduceAll, RefusesToContinueARunOfOtherOptions) {
  EXPECT_NE(refusal(command({"--continue"})).find("has seed 7, this one null; allowed: the same"),
            std::string::npos);
  EXPECT_NE(refusal(command({"--seed", "7", "--runs", "4", "--continue"})).find("has runs null"),
            std::string::npos);
  EXPECT_NE(refusal({"reproduce", "all", "-o", out_, "--seed", "7", "--data", folder_.path(),
                     "--continue"})
                .find("has quick true, this one false"),
            std::string::npos);
  json run = read_json(out_ / "run.json");
  run["version"] = "0.0.1";
  write(out_ / "run.json", run);
  EXPECT_NE(refusal(continued()).find("has version \"0.0.1\""), std::string::npos);
  run["version"] = json::array();
  write(out_ / "run.json", run);
  EXPECT_NE(refusal(continued()).find("run.json: version is an array"), std::string::npos);
  run.erase("version");
  write(out_ / "run.json", run);
  EXPECT_NE(refusal(continued()).find("run.json: version is missing"), std::string::npos);
  std::ofstream(out_ / "run.json") << "{";
  EXPECT_NE(refusal(continued()).find("run.json: is no JSON object"), std::string::npos);
  fs::remove(out_ / "run.json");
  EXPECT_NE(refusal(continued()).find("run.json: is not there"), std::string::npos);
  EXPECT_TRUE(fs::exists(out_ / "y03/results.json"));
}

TEST_F(ReproduceAll, RefusesDamagedResultsAndWhatHasNoMeaning) {
  json rows = read_json(out_ / "s06/results.json");
  rows[1]["ours"] = "much";
  write(out_ / "s06/results.json", rows);
  EXPECT_NE(refusal(continued()).find("s06/results.json: row 2: ours is \"much\"; allowed: "),
            std::string::npos);
  EXPECT_NE(refusal(command({"--only", "office"})).find("--only has no meaning for all"),
            std::string::npos);
  EXPECT_NE(refusal({"reproduce", "m04", "--quick", "-o", folder_ / "x", "--continue"})
                .find("--continue has no meaning for m04"),
            std::string::npos);
}

}  // namespace
}  // namespace panonav::testing
