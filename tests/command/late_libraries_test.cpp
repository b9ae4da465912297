// Shared libraries that only some verbs need are loaded by these verbs alone.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "command/memorise.hpp"

namespace panonav::testing {
namespace {

/// Puts a file that is no library in the place of each library that is loaded late.
class LateLibraries : public Memorise {
 protected:
  void SetUp() override {
    Memorise::SetUp();
    if (libraries_.empty()) GTEST_SKIP() << "This build loads all libraries at the start";
    run_well({"memorise", memory(), data()});
    std::filesystem::create_directory(folder_ / "lib");
    for (const std::string& library : libraries_) folder_.write("lib/" + library, "no library\n");
    if (const char* before = std::getenv("LD_LIBRARY_PATH")) path_before_ = before;
    const std::string path = (folder_ / "lib").string() + ":" + path_before_;
    ASSERT_EQ(setenv("LD_LIBRARY_PATH", path.c_str(), 1), 0);
  }
  void TearDown() override {
    if (path_before_.empty()) {
      unsetenv("LD_LIBRARY_PATH");
    } else {
      setenv("LD_LIBRARY_PATH", path_before_.c_str(), 1);
    }
  }
  /// Expects that a verb refuses since it needs a library whose name begins so.
  void expect_needed(const std::string& library, const std::vector<std::string>& arguments) {
    for (const std::string& name : libraries_) {
      if (!name.starts_with(library)) continue;
      const std::string line = refusal(arguments, {.kill_after_ms = 60000});
      EXPECT_NE(line.find((folder_ / "lib" / name).string() + ": file too short"),
                std::string::npos)
          << line;
    }
  }

 private:
  std::vector<std::string> libraries_ = words_of(PANONAV_LATE_LIBRARIES);
  std::string path_before_;
};

TEST_F(LateLibraries, VerbsThatDoNotCallThemRunWithoutThem) {
  EXPECT_EQ(run_panonav({"--version"}).exit_code, 0);
  EXPECT_EQ(views_in(memory()), 16);
  run_well({"localise", memory(), data()});
  run_well({"memorise", folder_ / "again.panonav", data()});
}

TEST_F(LateLibraries, VerbsThatCallThemNameTheMissingLibrary) {
  expect_needed("libpq.", {"info", "postgresql://nobody@127.0.0.1:1/x?memory=m"});
  expect_needed("libembree", {"simulate", "office", folder_ / "run", "--random", "1"});
  const auto mesh = folder_.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n");
  expect_needed("libassimp", {"simulate", mesh, folder_ / "run", "--random", "1"});
  expect_needed("libmicrohttpd", {"serve", memory(), "--listen", "127.0.0.1:0"});
  expect_needed("libddsc", {"ros2", memory()});
}

}  // namespace
}  // namespace panonav::testing
