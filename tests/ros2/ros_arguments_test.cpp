#include "panonav_ros2/ros_arguments.hpp"

#include <gtest/gtest.h>

#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::ros2 {
namespace {

using Words = std::vector<std::string>;

std::string value_of(const RosArguments& read, const std::string& name) {
  std::string all;
  for (const auto& each : read.parameters) {
    if (each.name != name) continue;
    for (const auto& value : each.values) all += (all.empty() ? "" : " ") + value;
  }
  return all;
}

TEST(RosArguments, AreTakenAsLaunchFilesPassThem) {
  const testing::TemporaryFolder folder;
  write_file(folder / "robot.yaml", R"(/**:
  ros__parameters: {use_sim_time: true, motion: tf, speed_m_s: 0.1}
amcl:
  ros__parameters: {motion: odometry}
panonav:
  ros__parameters: {motion: "no"}
/robot/panonav:
  ros__parameters:
    speed_m_s: 0.25
    band: [-0.5, 0.6]
    outer: {inner: 3}
)");
  const std::string file = (folder / "robot.yaml").string();
  const auto read = read_ros_arguments(Words{"a.panonav",
                                             "--quiet",
                                             "--ros-args",
                                             "-r",
                                             "__ns:=/robot",
                                             "--params-file",
                                             file,
                                             "--remap",
                                             "image:=/camera",
                                             "-r",
                                             "amcl:odom:=/other",
                                             "-r",
                                             "panonav:odom:=/wheels",
                                             "-p",
                                             "use_sim_time:=false",
                                             "--log-level",
                                             "info",
                                             "--disable-rosout-logs",
                                             "--",
                                             "imu:=/imu/data"},
                                       "panonav", "/");
  EXPECT_EQ(read.words, (Words{"a.panonav", "--quiet", "imu:=/imu/data"}));
  const std::map<std::string, std::string> remappings{
      {"__ns", "/robot"}, {"image", "/camera"}, {"odom", "/wheels"}};
  EXPECT_EQ(read.remappings, remappings);
  EXPECT_EQ(value_of(read, "use_sim_time"), "false");
  EXPECT_EQ(value_of(read, "motion"), "tf");
  EXPECT_EQ(value_of(read, "speed_m_s"), "0.25");
  EXPECT_EQ(value_of(read, "band"), "-0.5 0.6");
  EXPECT_EQ(value_of(read, "outer.inner"), "3");
  EXPECT_EQ(read_ros_arguments(Words{"a", "--", "b"}, "n", "/").words, (Words{"a", "--", "b"}));
}

TEST(RosArguments, OneLineTellsWhatIsWrong) {
  const testing::TemporaryFolder folder;
  const auto refusal = [](const Words& words) -> std::string {
    try {
      (void)read_ros_arguments(words, "panonav", "/");
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return error.what();
    }
    return "taken";
  };
  for (const Words& words :
       {Words{"--ros-args", "-p"}, Words{"--ros-args", "-p", "motion"},
        Words{"--ros-args", "-p", "motion:=[1"}, Words{"--ros-args", "-r", ":=x"},
        Words{"--ros-args", "--color"}, Words{"--ros-args", "--params-file", "/nowhere.yaml"}}) {
    EXPECT_NE(refusal(words), "taken") << words.back();
  }
  std::string aliases = "panonav: {ros__parameters: {a0: &a0 {x: {}}";
  for (int i = 1; i < 12; ++i) {
    const std::string of = "*a" + std::to_string(i - 1);
    aliases += ", a" + std::to_string(i) + ": &a" + std::to_string(i) + " {";
    for (int k = 0; k < 10; ++k) aliases += (k > 0 ? ", k" : "k") + std::to_string(k) + ": " + of;
    aliases += "}";
  }
  aliases += "}}";
  for (const std::string& text : std::vector<std::string>{
           aliases, "", "3", "panonav: 3", "panonav: {ros__parameters: 3}",
           "panonav: {ros__parameters: {a: }}", "panonav: {ros__parameters: {a: [[1], 2]}}", "[[[[",
           "a: *b", "panonav: &p {ros__parameters: &q {a: *q}}"}) {
    write_file(folder / "bad.yaml", text);
    EXPECT_NE(
        refusal({"--ros-args", "--params-file", (folder / "bad.yaml").string()}).find("bad.yaml"),
        std::string::npos)
        << text << ": " << refusal({"--ros-args", "--params-file", (folder / "bad.yaml").string()});
  }
}

}  // namespace
}  // namespace panonav::ros2
