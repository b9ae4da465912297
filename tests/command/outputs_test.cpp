// No output replaces what the command reads, whatever names lead to it.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "panonav/io/atomic_file.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

/// Files that are only looked at: the command line is refused before anything is read.
class Outputs : public ::testing::Test {
 protected:
  Outputs() : before_(fs::current_path()) {
    fs::current_path(folder_.path());
    fs::create_directories("run/pictures");
    for (const char* name : {"m.panonav", "m.panonav-wal", "n.panonav", "run/poses.csv",
                             "run/pictures/a.png", "mask.png", "options.toml"}) {
      write_file(name, std::string_view(""));
    }
    write_file("camera.toml", std::string_view("mask = \"mask.png\"\n"));
    fs::create_directory("page");
  }
  ~Outputs() override { fs::current_path(before_); }

  static void expect_kept(const Words& words, const std::string& target, const std::string& input) {
    expect_refusal(words, "is " + target);
    expect_refusal(words, input);
    expect_refusal(words, "allowed: another file");
    EXPECT_FALSE(fs::exists("run/pictures/.a.png.tmp"));
  }

 private:
  TemporaryFolder folder_;
  fs::path before_;
};

TEST_F(Outputs, NothingThatTheCommandReadsIsReplaced) {
  fs::create_symlink("m.panonav", "link.csv");
  fs::create_symlink("link.csv", "second.csv");
  fs::create_hard_link("m.panonav", "hard.csv");
  fs::create_directory_symlink("run", "same");
  fs::create_directory("elsewhere");
  fs::rename("run/pictures", "elsewhere/pictures");
  fs::create_directory_symlink("../elsewhere/pictures", "run/pictures");
  fs::create_directory_symlink("..", "run/up");  // a cycle ends
  for (const std::string target :
       {"m.panonav", "./run/../m.panonav", "link.csv", "second.csv", "hard.csv", "m.panonav-wal"}) {
    expect_kept({"localise", "m.panonav", "mask.png", "-o", target}, target, "MEMORY m.panonav");
  }
  for (const std::string target : {"run/poses.csv", "same/poses.csv", "elsewhere/pictures/a.png"}) {
    expect_kept({"track", "n.panonav", "run", "--tum", target}, target, "INPUT run");
  }
  expect_kept({"unwrap", "run", "--camera", "camera.toml", "-o", "mask.png"}, "mask.png",
              "--camera camera.toml");
  expect_kept({"track", "m.panonav", "mask.png", "--tum", "new", "--record", "new"}, "new",
              "--tum");
}

/// "--out" of rows "-o, --out FILE" whose value is of this kind.
std::vector<std::string> flags_with(const std::string& help, const std::string& value) {
  std::vector<std::string> flags;
  for (const auto& line : lines(help)) {
    const std::size_t at = line.find("--");
    if (!line.starts_with("  -") || at == std::string::npos) continue;
    std::istringstream words(line.substr(at));
    std::string flag, kind;
    words >> flag >> kind;
    if (kind == value) flags.push_back(flag);
  }
  return flags;
}

TEST_F(Outputs, EveryFlagOfEveryVerbIsEitherReadOrGuarded) {
  const std::set<std::string> read{"--camera", "--config",     "--memory",
                                   "--data",   "--token-file", "--trajectory"};
  const std::map<std::string, Words> inputs{
      {"try", {"run"}},
      {"simulate", {"room"}},
      {"calibrate", {"run"}},
      {"unwrap", {"run"}},
      {"show", {"m.panonav", "v"}},
      {"gallery", {"m.panonav"}},
      {"export", {"m.panonav"}},
      {"localise", {"m.panonav", "run"}},
      {"track", {"m.panonav", "run"}},
      {"map", {"m.panonav", "run"}},
      {"arrange", {"m.panonav"}},
      {"home", {"run", "run"}},
      {"home learn", {"m.panonav", "run"}},
      {"route record", {"m.panonav", "run"}},
      {"route follow", {"m.panonav", "run"}},
      {"navigate", {"m.panonav", "--goal", "1", "--scene", "office"}},
      {"catchment", {"run"}},
      {"reproduce", {"all"}},
      {"merge", {"m.panonav", "n.panonav"}}};
  fs::create_symlink("options.toml", "link");
  fs::create_symlink("../options.toml", "page/index.html");
  std::size_t guarded = 0;
  bool inside = false;
  for (const auto& row : lines(run_panonav({"--help"}).out)) {
    if (row == "First steps:") inside = true;
    if (!inside || !row.starts_with("  ") || row[2] == ' ') continue;
    const std::string verb = row.substr(2, row.find("  ", 2) - 2);
    Words words;
    std::istringstream split(verb);
    for (std::string word; split >> word;) words.push_back(word);
    const std::string help = run_panonav(with(words, {"--help-all"})).out;
    const auto more = inputs.find(verb);
    if (more != inputs.end()) words = with(words, more->second);
    for (const std::string value : {"FILE", "FOLDER", "MEMORY"}) {
      const std::string target = value == "FOLDER" ? "page" : "link";
      for (const auto& flag : flags_with(help, value)) {
        if (read.contains(flag)) continue;
        Words typed = with(words, {"--config", "options.toml", flag, target});
        if (verb == "calibrate" && flag != "--out") typed = with(typed, {"-o", "new"});
        expect_kept(typed, target, "--config options.toml");
        ++guarded;
      }
    }
  }
  EXPECT_GE(guarded, 30U);
  for (const Words& words : {Words{"convert", "link", "link"},
                             {"copy", "link", "link"},
                             {"simulate", "page/index.html", "page"}}) {
    expect_kept(words, words.back(), words[1]);
  }
}

TEST_F(Outputs, ADatabaseIsNotReplaced) {
  const std::string database = std::string("SQLite format 3") + '\0' + "more";
  write_file("any.dat", database);
  fs::create_symlink("any.dat", "link.mcap");
  write_picture("run/pictures/a.png", landmark_world(3), {}, 96, 48);
  const Words kind{"--kind", "equirectangular", "--elevation-deg", "-30", "40"};
  expect_refusal(with({"unwrap", "run/pictures/a.png", "-o", "any.dat"}, kind), "SQLite");
  expect_refusal(with({"convert", "run/pictures", "link.mcap"}, kind), "SQLite");
  EXPECT_EQ(bytes_of("any.dat"), database);
  EXPECT_TRUE(fs::is_symlink("link.mcap"));
}

}  // namespace
}  // namespace panonav::testing
