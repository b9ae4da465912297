// Runs the command on a camera, which v4l2_shim.cpp plays.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "command/walk.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"
#include "support/command_runner.hpp"

namespace panonav::testing {
namespace {

using nlohmann::json;

#ifdef PANONAV_V4L2_SHIM
TEST_F(Walk, InfoListsWhatACameraOffers) {
  const json info =
      json::parse(said_by_shell("V4L2_SHIM_PICTURES=/dev/null "
                                "ASAN_OPTIONS=verify_asan_link_order=0:detect_leaks=0 LD_PRELOAD=" +
                                    quote_for_shell(PANONAV_V4L2_SHIM) + " " +
                                    quote_for_shell(PANONAV_COMMAND) + " info /dev/video7 --json",
                                folder.path()));
  ASSERT_EQ(info.at("formats").size(), 2U);
  EXPECT_EQ(info.at("formats")[0].at("pixels"), "H264");
  EXPECT_FALSE(info.at("formats")[0].at("usable"));
  EXPECT_EQ(info.at("formats")[1].at("pixels"), "MJPG");
  EXPECT_EQ(info.at("formats")[1].at("sizes")[0].at("width"), 96);
}

TEST_F(Walk, RunFollowsACameraThatIsUnpluggedAndComesBack) {
  write_camera_pictures();
  run_well({"memorise", path("a.panonav"), path("walk")});
  const std::string command = "V4L2_SHIM_RATE=20 V4L2_SHIM_UNPLUG=10 V4L2_SHIM_PICTURES=" +
                              quote_for_shell(path("pictures")) +
                              " ASAN_OPTIONS=verify_asan_link_order=0:detect_leaks=0 LD_PRELOAD=" +
                              quote_for_shell(PANONAV_V4L2_SHIM) + " timeout -s INT 20 " +
                              quote_for_shell(PANONAV_COMMAND) + " localise " +
                              quote_for_shell(path("a.panonav")) +
                              " /dev/video7 --json --count 30 2> " + quote_for_shell(path("notes"));
  const auto answers = objects(said_by_shell(command, folder.path()));
  ASSERT_EQ(answers.size(), 30U);
  std::size_t right = 0;
  double before_s = 0.0;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    EXPECT_GT(answers[i].at("stamp_s"), before_s);
    before_s = answers[i].at("stamp_s");
    right += answers[i].at("known").get<bool>() ? 1 : 0;
  }
  EXPECT_GE(right, 27U);
  std::ostringstream notes;
  notes << std::ifstream(path("notes")).rdbuf();
  EXPECT_NE(notes.str().find("1 interruption of the source"), std::string::npos) << notes.str();
}

TEST_F(Walk, AnInterruptedMemoriseHasStoredWhatTheCameraSaw) {
  write_camera_pictures();
  const std::string command =
      "V4L2_SHIM_RATE=50 V4L2_SHIM_PICTURES=" + quote_for_shell(path("pictures")) +
      " ASAN_OPTIONS=verify_asan_link_order=0:detect_leaks=0 LD_PRELOAD=" +
      quote_for_shell(PANONAV_V4L2_SHIM) + " timeout --preserve-status -s INT 3 " +
      quote_for_shell(PANONAV_COMMAND) + " memorise " + quote_for_shell(path("new.panonav")) +
      " /dev/video7 --every 0.2s --json --kind panorama --elevation-deg -20 20 2> " +
      quote_for_shell(path("notes"));
  const auto said = objects(said_by_shell(command, folder.path()));
  ASSERT_EQ(said.size(), 1U);
  EXPECT_GE(said[0].at("appended"), 5);
  EXPECT_LE(said[0].at("appended"), 16);  // five a second, and not fifty
  EXPECT_EQ(views(path("new.panonav")).size(), said[0].at("views"));
  run_well({"verify", path("new.panonav")});
}

TEST_F(Walk, AnInterruptedRunHasStoredWhatItAdded) {
  write_camera_pictures();
  const std::string command =
      "V4L2_SHIM_RATE=50 V4L2_SHIM_PICTURES=" + quote_for_shell(path("pictures")) +
      " ASAN_OPTIONS=verify_asan_link_order=0:detect_leaks=0 LD_PRELOAD=" +
      quote_for_shell(PANONAV_V4L2_SHIM) + " timeout --preserve-status -s INT 3 " +
      quote_for_shell(PANONAV_COMMAND) + " localise " + quote_for_shell(path("new.panonav")) +
      " /dev/video7 --add --add-interval-s 0.2 --json --kind panorama --elevation-deg -20 20";
  const auto answers = objects(said_by_shell(command, folder.path()));
  std::size_t added = 0;
  for (const auto& answer : answers) added += answer.at("added").get<bool>() ? 1 : 0;
  EXPECT_GE(added, 5U);
  EXPECT_EQ(views(path("new.panonav")).size(), added);
  run_well({"verify", path("new.panonav")});
}

/// Ten minutes with PANONAV_SOAK_S=600, otherwise some seconds.
TEST_F(Walk, ARunOutlivesLostCamerasAStalledReaderAndAClockThatIsSetBack) {
  write_camera_pictures();
  run_well({"memorise", path("a.panonav"), path("walk")});
  const char* const soak_s = std::getenv("PANONAV_SOAK_S");
  const int seconds = soak_s != nullptr ? std::atoi(soak_s) : 8;
  const int losses = soak_s != nullptr ? 10 : 2;
  constexpr int rate = 100;
  const std::string script =
      "mkfifo out\n"
      "(sleep " +
      std::to_string(seconds) +
      "; cat) < out > lines &\n"
      "V4L2_SHIM_RATE=" +
      std::to_string(rate) + " V4L2_SHIM_PICTURES=pictures V4L2_SHIM_UNPLUG=" +
      std::to_string(seconds * rate / (2 * losses)) +
      " V4L2_SHIM_UNPLUGS=" + std::to_string(losses) +
      " V4L2_SHIM_CLOCK_BACK=" + std::to_string(seconds * rate / 3) +
      " V4L2_SHIM_TAKEN=taken LD_PRELOAD=" + quote_for_shell(PANONAV_V4L2_SHIM) + " " +
      quote_for_shell(PANONAV_COMMAND) +
      " localise a.panonav /dev/video7 --add --update --record run.mcap --json > out 2> notes &\n"
      "run=$!\n"
      "resident() { grep VmRSS /proc/$run/status | tr -dc 0-9; }\n"
      "sleep " +
      std::to_string(seconds / 2) +
      "; resident > early\n"
      "sleep " +
      std::to_string(seconds - seconds / 2 - 1) +
      "; resident > late\n"
      "kill -INT $run; wait $run; echo $? > code; wait\n";
  write_file(folder / "script", std::string_view(script));
  said_by_shell("cd " + quote_for_shell(folder.path().string()) + " && bash script", folder.path());

  const auto number_in = [&](const std::string& file) {
    std::uint64_t number = 0;
    EXPECT_TRUE(std::ifstream(path(file)) >> number) << file;
    return number;
  };
  std::ostringstream notes;
  notes << std::ifstream(path("notes")).rdbuf();
  const std::string said = notes.str();
  EXPECT_EQ(number_in("code"), 0U) << said;
  const auto counted = [&](const std::string& what) {
    std::smatch found;
    const bool is_there = std::regex_search(said, found, std::regex("(\\d+) " + what));
    return is_there ? std::stoull(found[1]) : 0ULL;
  };
  EXPECT_EQ(counted("interruptions? of the source"), losses) << said;
  std::uint64_t frames_consumed = 0;
  std::ifstream(path("taken"), std::ios::binary).read(reinterpret_cast<char*>(&frames_consumed), 8);
  const std::uint64_t pictures = counted("images, ");
  const std::uint64_t accounted = pictures + counted("images? skipped because of too fast a rate");
  // The last picture of all may still wait, and so may one at each loss.
  EXPECT_LE(accounted, frames_consumed) << said;
  EXPECT_GE(accounted + 1 + static_cast<std::uint64_t>(losses), frames_consumed) << said;
  EXPECT_GT(pictures, frames_consumed / 4) << said;
  EXPECT_EQ(objects(said_by_shell("cat " + quote_for_shell(path("lines")), folder.path())).size() +
                counted("lines not printed because the reader was too slow"),
            pictures)
      << said;
  EXPECT_GT(counted("lines not printed because the reader was too slow"), 0U) << said;
  constexpr std::uint64_t max_growth_kb = 8 * 1024;
  EXPECT_LE(number_in("late"), number_in("early") + max_growth_kb);
  const double delay_ms = std::stod(said.substr(said.find("from arrival to answer") + 23));
  EXPECT_GT(delay_ms, 0.0) << said;
  EXPECT_LT(delay_ms, 1000.0) << said;
  run_well({"verify", path("a.panonav")});
  EXPECT_FALSE(answer_of({"info", path("run.mcap"), "--json"}).at("topics").empty());
}
#endif

}  // namespace
}  // namespace panonav::testing
