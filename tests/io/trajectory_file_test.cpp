#include "panonav/io/trajectory_file.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

using TrajectoryFiles = InTemporaryFolder;

TEST_F(TrajectoryFiles, TumAndCsvReadBackTheSame) {
  std::vector<StampedPose> trajectory;
  for (int i = 0; i < 20; ++i) {
    trajectory.push_back({0.1 * i, {0.3 * i, -0.01 * i * i, wrap_angle(0.5 * i)}});
  }
  for (const char* name : {"trajectory.tum", "trajectory.csv"}) {
    const fs::path path = folder / name;
    write_trajectory(path, trajectory);
    const auto back = read_trajectory(path);
    ASSERT_EQ(back.size(), trajectory.size());
    for (std::size_t i = 0; i < back.size(); ++i) {
      EXPECT_DOUBLE_EQ(back[i].stamp_s, trajectory[i].stamp_s);
      EXPECT_EQ(back[i].pose.position(), trajectory[i].pose.position());
      EXPECT_NEAR(angle_difference(back[i].pose.heading_rad, trajectory[i].pose.heading_rad), 0.0,
                  1e-12);
    }
  }
}

TEST_F(TrajectoryFiles, FaultsNameTheLine) {
  const fs::path path = folder / "trajectory.tum";
  const auto message = [&](const std::string& text) -> std::string {
    std::ofstream(path) << text;
    return message_of<FileError>([&] { (void)read_trajectory(path); });
  };
  EXPECT_TRUE(contains(message("0 1 2 0 0 0 0 1\n1 2 3\n"), "line 2"));
  EXPECT_TRUE(contains(message("0 1 nan 0 0 0 0 1\n"), "line 1"));
  EXPECT_TRUE(contains(message("0 1 2 0 0 0 0 0.5\n"), "quaternion"));
  EXPECT_TRUE(contains(message("1 1 2 0 0 0 0 1\n0.9 1 2 0 0 0 0 1\n"), "line 2: stamp is 0.9"));
  EXPECT_TRUE(contains(message("# nothing\n"), "no pose"));
}

class TrajectoryFormats : public InTemporaryFolder {
 protected:
  [[nodiscard]] TrajectoryFile read(const std::string& text) const {
    std::ofstream(folder / "poses") << text;
    return read_trajectory_file(folder / "poses");
  }
  [[nodiscard]] std::string refusal(const std::string& text) const {
    return message_of<FileError>([&] { (void)read(text); });
  }
};

TEST_F(TrajectoryFormats, TumKeepsHeightAndTilt) {
  const auto file = read("# stamp\n1.5 1 2 3 0.5 0.5 0.5 0.5\n2 1 2 3 0 0 0 -1\n");
  EXPECT_EQ(file.format, "TUM");
  EXPECT_EQ(file.units, TrajectoryUnits{});
  ASSERT_EQ(file.poses.size(), 2U);
  EXPECT_EQ(file.poses[0], (StampedPose3{1.5, {{1, 2, 3}, {0.5, 0.5, 0.5, 0.5}}}));
  EXPECT_EQ(read_trajectory(folder / "poses")[0].pose.position(), (Point2{1, 2}));
}

TEST_F(TrajectoryFormats, KittiHasTheRowsOfAMatrixAndNoStamps) {
  const auto file = read("1 0 0 0 0 1 0 0 0 0 1 0\n0 0 1 4 -1 0 0 5.5e0 0 -1 0 6\n");
  EXPECT_EQ(file.format, "KITTI");
  EXPECT_EQ(file.units.times, TrajectoryUnits::Times::none);
  ASSERT_EQ(file.poses.size(), 2U);
  EXPECT_EQ(file.poses[1].stamp_s, 1.0);
  EXPECT_EQ(file.poses[1].pose.position, (Point3{4, 5.5, 6}));
  const Point3 forward = file.poses[1].pose.rotation * Point3{0, 0, 1};
  EXPECT_NEAR(distance(forward, {1, 0, 0}), 0.0, 1e-12);
  EXPECT_TRUE(contains(message_of<FileError>([&] { (void)read_trajectory(folder / "poses"); }),
                       "has no stamps"));
  EXPECT_TRUE(contains(refusal("2 0 0 0 0 1 0 0 0 0 1 0\n"), "line 1: the rows of the rotation"));
  EXPECT_TRUE(contains(refusal("-1 0 0 0 0 1 0 0 0 0 1 0\n"), "determinant"));
  EXPECT_TRUE(
      contains(refusal("1 0 0 0 0 1 0 0 0 0 1 0\n1 2 3\n"), "line 2 is not a pose in KITTI"));
}

TEST_F(TrajectoryFormats, EurocHasNanosecondsAndWFirst) {
  const std::string header = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w []\n";
  const auto file = read(header +
                         "1403636580838555648,4.6,-1.7,0.7,0.6,-0.8,0,0,1,2,3,4,5,6,7,8,9\n"
                         "1403636580843555648,4.6,-1.7,0.7,0.6,-0.8,0,0,1,2,3,4,5,6,7,8,9\n");
  EXPECT_EQ(file.format, "EuRoC");
  ASSERT_EQ(file.poses.size(), 2U);
  EXPECT_NEAR(file.poses[0].stamp_s, 1403636580.838555648, 1e-6);
  EXPECT_NEAR(file.poses[0].pose.rotation.w, 0.6, 1e-12);
  EXPECT_NEAR(file.poses[0].pose.rotation.x, -0.8, 1e-12);
  EXPECT_EQ(read("1403636580838555648, 1, 2, 3, 1, 0, 0, 0\n").format, "EuRoC");
  EXPECT_EQ(read("1403636580.8, 1, 2, 3, 0, 0, 0, 1\n").format, "TUM");
  EXPECT_TRUE(contains(refusal(header + "1403636580838555648,4,1,0,2,0,0,0,1\n"), "quaternion"));
}

TEST_F(TrajectoryFormats, OfEqualStampsTheFirstIsKept) {
  const auto file = read("1 1 2 0 0 0 0 1\n1 5 2 0 0 0 0 1\n1 6 2 0 0 0 0 1\n2 7 2 0 0 0 0 1\n");
  EXPECT_EQ(file.repeated, 2U);
  ASSERT_EQ(file.poses.size(), 2U);
  EXPECT_EQ(file.poses[0].pose.position.x_m, 1.0);
  EXPECT_EQ(read("stamp_s,x_m,y_m,heading_deg\n0,1,2,90\n0,1,3,90\n").repeated, 1U);
}

TEST_F(TrajectoryFormats, OthersAreRefusedWithWhatIsAllowed) {
  EXPECT_EQ(read("stamp_s,x_m,y_m,heading_deg\n0,1,2,90\n").format, "CSV");
  for (const char* text : {"hello\n", "1 2 3\n", "1 2 3 4 5 6 7 8 9\n", "1,2,3\n"}) {
    const std::string line = refusal(text);
    EXPECT_TRUE(contains(line, "line 1 is not a pose; allowed: TUM")) << line;
    EXPECT_TRUE(contains(line, "KITTI") && contains(line, "EuRoC")) << line;
  }
  EXPECT_TRUE(contains(refusal("0 1 2 1e9 0 0 0 1\n"), "line 1: z is 1e+09"));
  EXPECT_TRUE(contains(refusal("file,x_m,heading_deg\na.png,0,1\n"), "has no column 'y_m'"));
}

TEST_F(TrajectoryFormats, UnitsAreWrittenAndReadBack) {
  using Times = TrajectoryUnits::Times;
  const std::vector<StampedPose> poses{{0.0, {1, 2, 0.5}}, {3.0, {2, 2, 0.5}}};
  for (const TrajectoryUnits units :
       {TrajectoryUnits{}, TrajectoryUnits{Times::stamps, false},
        TrajectoryUnits{Times::image_numbers, true}, TrajectoryUnits{Times::none, false}}) {
    for (const char* name : {"units.tum", "units.csv"}) {
      write_trajectory(folder / name, poses, units);
      const auto file = read_trajectory_file(folder / name);
      EXPECT_EQ(file.units, units) << name;
      ASSERT_EQ(file.poses.size(), 2U);
      EXPECT_EQ(file.poses[1].pose.position, (Point3{2, 2, 0}));
      if (units.times == Times::image_numbers) {
        EXPECT_EQ(file.poses[1].stamp_s, 3.0);
      }
      if (units == TrajectoryUnits{}) continue;
      const auto line = message_of<FileError>([&] { (void)read_trajectory(folder / name); });
      EXPECT_TRUE(contains(line, units.times == Times::stamps ? "view steps" : "stamps")) << line;
    }
  }
}

TEST_F(TrajectoryFormats, PositionsNeedNoHeadings) {
  const auto table = read("stamp_s,x_m,y_m\n0,1,2\n1,3,4\n");
  EXPECT_FALSE(table.has_rotations);
  EXPECT_EQ(table.poses.at(1).pose, (Pose3{{3, 4, 0}, {}}));
  EXPECT_TRUE(contains(message_of<FileError>([&] { (void)read_trajectory(folder / "poses"); }),
                       "has no headings"));
  // One missing heading leaves out all, and a row without a position is left out.
  const auto some = read("file,x_m,y_m,heading_deg\na,1,2,90\nb,,,\nc,3,4,\n");
  EXPECT_FALSE(some.has_rotations);
  EXPECT_EQ(some.units.times, TrajectoryUnits::Times::image_numbers);
  ASSERT_EQ(some.poses.size(), 2U);
  EXPECT_EQ(some.poses[0].pose.rotation, Rotation3{});
  EXPECT_EQ(some.poses[1].stamp_s, 2.0);
  const auto leica = read("#timestamp [ns], x [m], y, z\n1403636580838555648,4.6,-1.7,0.7\n");
  EXPECT_EQ(leica.format, "positions");
  EXPECT_NEAR(leica.poses.at(0).stamp_s, 1403636580.838555648, 1e-6);
  EXPECT_EQ(read("1.5 1 2 3\n").poses.at(0), (StampedPose3{1.5, {{1, 2, 3}, {}}}));
}

}  // namespace
}  // namespace panonav::testing
