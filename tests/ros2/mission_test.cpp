#include "panonav_ros2/mission.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "panonav/io/atomic_file.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::ros2 {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::TemporaryFolder;

class MissionFileTest : public ::testing::Test {
 protected:
  /// True if the mission in the file sends a robot on.
  bool is_resumed() {
    MissionFile file(folder_ / "hall.panonav", 30.0);
    const auto mission = file.load(log_);
    EXPECT_EQ(fs::exists(path_), mission.has_value());
    return mission.has_value();
  }
  void store(const Mission& mission) {
    MissionFile(folder_ / "hall.panonav", 30.0).store_if_due(mission, Pose2{1.0, 2.0, 0.5});
  }
  /// Replaces the last word of the file, the seconds, by themselves and `added`; or the word
  /// before.
  void change_time(double added_s, const std::string& boot = "") {
    std::string text = read_text();
    const std::size_t blank = text.rfind(' ');
    const double seconds = std::stod(text.substr(blank)) + added_s;
    const std::size_t before = text.rfind(' ', blank - 1);
    const std::string kept = boot.empty() ? text.substr(before + 1, blank - before - 1) : boot;
    write_file(path_, text.substr(0, before + 1) + kept + " " + std::to_string(seconds) + "\n");
  }
  std::string read_text() const {
    const auto bytes = read_file(path_, 1000);
    return {bytes.begin(), bytes.end()};
  }

  const TemporaryFolder folder_;
  const fs::path path_ = folder_ / "hall.panonav.mission";
  std::vector<std::string> notes_;
  WarningLog log_{[this](const std::string& line) { notes_.push_back(line); }};
};

TEST_F(MissionFileTest, ARestartedNodeGoesOn) {
  EXPECT_FALSE(is_resumed());
  store({.goal = Pose2{3.0, -4.0, 1.0}});
  const auto goal = MissionFile(folder_ / "hall.panonav", 30.0).load(log_);
  ASSERT_TRUE(goal && goal->goal);
  EXPECT_EQ(goal->goal->y_m, -4.0);
  EXPECT_EQ(goal->map_from_odom.y_m, 2.0);
  store({.route = "the long way", .along_m = 1.5});
  const auto repeat = MissionFile(folder_ / "hall.panonav", 30.0).load(log_);
  ASSERT_TRUE(repeat);
  EXPECT_EQ(repeat->route, "the long way");
  EXPECT_EQ(repeat->along_m, 1.5);
  EXPECT_TRUE(notes_.empty());
}

TEST_F(MissionFileTest, NoRobotIsSentOnFromAnotherTime) {
  const auto each = [&](const auto& change) {
    store({.route = "way"});
    change();
    EXPECT_FALSE(is_resumed());
  };
  const auto now = fs::file_time_type::clock::now();
  each([&] { fs::last_write_time(path_, now + 1h); });  // a clock was set back
  each([&] { fs::last_write_time(path_, now + 2s); });
  each([&] { fs::last_write_time(path_, now - 40s); });
  each([&] { change_time(-40.0); });  // a clock was set back so that the age of the file is right
  each([&] { change_time(60.0); });
  each([&] { change_time(0.0, "0f5c7b1e-0000-4000-8000-000000000000"); });  // another start
  each([&] { write_file(path_, "1 2 3 repeat 0 0 way\n"); });               // of a version before
  each([&] { write_file(path_, read_text().substr(0, read_text().size() / 2)); });
  each([&] { write_file(path_, "1 2 3 goal 1 2 3 written " + std::string("x nan\n")); });
}

}  // namespace
}  // namespace panonav::ros2
