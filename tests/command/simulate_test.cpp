#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav_recordings/recorded_dataset.hpp"
#include "support/command_runner.hpp"
#include "support/recorded_messages.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Small pictures, so that a test takes no time to speak of.
const std::vector<std::string> small{"--kind",    "panorama", "--rows",          "8",
                                     "--columns", "32",       "--rays-per-axis", "1"};

std::vector<std::string> with_small(std::vector<std::string> arguments) {
  return with(std::move(arguments), small);
}

using Simulate = InTemporaryFolder;

TEST_F(Simulate, WritesADataSetThatSaysWhereEachViewWasTaken) {
  const std::string out = folder / "run";
  const auto said = answer_of(with_small({"simulate", "office", out, "--grid", "1", "--json"}));
  EXPECT_EQ(keys_of(said),
            (std::set<std::string>{"dataset", "scene", "views", "free_area_m2", "warnings"}));
  EXPECT_EQ(said["scene"], "office");
  const Dataset dataset = read_dataset(out);
  ASSERT_GE(dataset.entries.size(), 8U);
  EXPECT_EQ(said["views"], dataset.entries.size());
  EXPECT_EQ(dataset.source.kind, PictureKind::panorama);
  for (const auto& entry : dataset.entries) {
    const Image picture = read_image(entry.path);
    EXPECT_EQ(picture.width(), 32);
    EXPECT_EQ(picture.height(), 8);
    ASSERT_TRUE(entry.pose);
    EXPECT_TRUE(entry.stamp_s);
    EXPECT_TRUE(entry.odometry);
    // A grid of 1 m, seen from its first place.
    const double steps = entry.pose->x_m - dataset.entries.front().pose->x_m;
    EXPECT_NEAR(steps, std::round(steps), 1e-9);
  }
  EXPECT_NE(bytes_of(dataset.entries[0].path), bytes_of(dataset.entries[1].path));
}

TEST_F(Simulate, AKilledRunDoesNotBlockItsFolder) {
  const std::string out = folder / "run";
  const auto words = with_small({"simulate", "office", out, "--grid", "0.5"});
  for (const int after_ms : {20, 60, 120, 250, 500}) {
    if (fs::exists(fs::path(out) / "dataset.toml")) fs::remove_all(out);
    (void)run_panonav(words, {.kill_after_ms = after_ms});
    EXPECT_EQ(fs::exists(out), fs::exists(fs::path(out) / "dataset.toml")) << "not whole";
  }
  fs::remove_all(out);
  fs::create_directory(out);
  run_well(words);
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    EXPECT_EQ(entry.path(), out) << "is left of a killed run";
  }
}

TEST_F(Simulate, ARecordOfASimulatedRunIsTheDataSetAgain) {
  const std::string record = folder / "run.mcap";
  run_well(with_small({"simulate", "office", folder / "run", "--path", "walk", "--poses", "12",
                       "--speed-m-s", "1", "--record", record}));
  expect_record(
      record, 12,
      {{"/ground_truth", {"geometry_msgs/PoseStamped", 12}}, {"/odom", {"nav_msgs/Odometry", 12}}});
  const Dataset written = read_dataset(folder / "run");
  const Dataset recorded = panonav::recordings::read_recording(record, written.source);
  ASSERT_EQ(recorded.entries.size(), 12U);
  for (std::size_t i = 0; i < 12; ++i) {
    const DatasetEntry& a = written.entries[i];
    const DatasetEntry& b = recorded.entries[i];
    EXPECT_EQ(read_image(a.path), read_picture(b));
    EXPECT_NEAR(*a.stamp_s, *b.stamp_s, 1e-6);
    EXPECT_NEAR(a.pose->x_m, b.pose->x_m, 1e-9);
    EXPECT_NEAR(*a.pose->heading_rad, *b.pose->heading_rad, 1e-6);
    EXPECT_NEAR(a.odometry->y_m, b.odometry->y_m, 1e-9);
  }
  // The tree of frames: where odometry leads is where the robot truly is.
  std::size_t moments = 0;
  for_each_message<recordings::ros::TFMessage>(
      record, "/tf", [&](const recordings::ros::TFMessage& tf) {
        ASSERT_EQ(tf.transforms.size(), 4U);
        const Pose2 map_from_base = recordings::ros::to_pose2(tf.transforms[2].transform) *
                                    recordings::ros::to_pose2(tf.transforms[1].transform);
        EXPECT_NEAR(map_from_base.x_m, written.entries[moments++].pose->x_m, 1e-9);
      });
}

TEST_F(Simulate, AMeshThatCrashesItsReaderGivesOneLine) {
  // A node that contains itself: the packaged reader follows it until its stack ends.
  const auto mesh = folder.write("cycle.dae",
                                 R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><up_axis>Z_UP</up_axis></asset>
<library_nodes><node id="a" name="a"><instance_node url="#a"/></node></library_nodes>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_node url="#a"/></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)");
  const auto line = refusal({"simulate", mesh, folder / "out", "--grid", "1"});
  EXPECT_TRUE(contains(line, mesh.string() + ": is damaged: the reader of its format crashes"));
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST_F(Simulate, ArenaOnAGridNeedsNoFurtherFlags) {
  const std::string out = folder / "run";
  run_well({"simulate", "arena", out, "--grid", "0.4"});
  const Dataset dataset = read_dataset(out);
  ASSERT_GE(dataset.entries.size(), 8U);
  EXPECT_EQ(dataset.source.kind, PictureKind::mirror);
  std::set<double> columns;
  for (const auto& entry : dataset.entries) {
    EXPECT_TRUE(fs::is_regular_file(entry.path)) << entry.path;
    ASSERT_TRUE(entry.pose);
    const double steps = (entry.pose->x_m - dataset.entries.front().pose->x_m) / 0.4;
    EXPECT_NEAR(steps, std::round(steps), 1e-9);
    columns.insert(std::round(steps));
  }
  EXPECT_GE(columns.size(), 3U);
}

TEST_F(Simulate, SameSeedSamePicturesOtherSeedOthers) {
  const auto run = [&](const std::string& name, const std::string& seed) {
    const std::string out = folder / name;
    run_well(with_small({"simulate", "lab", out, "--random", "2", "--seed", seed}));
    return bytes_of(fs::path(out) / "view_00000.png") + bytes_of(fs::path(out) / "view_00001.png") +
           bytes_of(fs::path(out) / "poses.csv");
  };
  const auto first = run("a", "7");
  EXPECT_GT(first.size(), 300U);
  EXPECT_EQ(first, run("b", "7"));
  EXPECT_NE(first, run("c", "8"));
}

TEST_F(Simulate, AMeasuredTiltIsWrittenAndTakenOutOfTheViews) {
  for (const std::string kind : {"panorama", "mirror"}) {
    SCOPED_TRACE(kind);
    const auto record = [&](const std::string& name, const std::string& tilt_rad) {
      const std::string out = folder / (kind + name);
      run_well({"simulate", "office", out, "--random", "4", "--kind", kind, "--rays-per-axis", "1",
                "--tilt-rad", tilt_rad});
      return read_dataset(out);
    };
    const Dataset level = record("level", "0");
    const Dataset tilted = record("tilted", "0.1");
    const PanoramaReader reader(level.source, {});
    double levelled_error = 0.0;
    double tilted_error = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_FALSE(level.entries[i].tilt);
      const Observation seen = read_observation(tilted.entries[i]);
      ASSERT_TRUE(seen.tilt);
      EXPECT_NEAR(std::hypot(seen.tilt->roll_rad, seen.tilt->pitch_rad), 0.1, 1e-9);
      const Image& picture = std::get<Image>(seen.picture);
      const Panorama truth = reader.read(level.entries[i].path);
      const Panorama blind = reader.convert(picture.view());
      const Panorama levelled = reader.convert(picture.view(), *seen.tilt);
      for (std::size_t k = 0; k < truth.values().size(); ++k) {
        levelled_error += std::abs(levelled.values()[k] - truth.values()[k]);
        tilted_error += std::abs(blind.values()[k] - truth.values()[k]);
      }
    }
    EXPECT_LT(levelled_error, 0.35 * tilted_error);
  }
}

TEST_F(Simulate, FollowsATrajectory) {
  std::ofstream(folder / "way.csv") << "stamp_s,x_m,y_m,heading_deg\n"
                                       "0,1,1,0\n2,1.5,1,90\n";
  const std::string out = folder / "run";
  run_well(with_small({"simulate", "office", out, "--trajectory", folder / "way.csv"}));
  const Dataset dataset = read_dataset(out);
  ASSERT_EQ(dataset.entries.size(), 2U);
  EXPECT_NEAR(dataset.entries[1].pose->x_m, 1.5, 1e-9);
  EXPECT_NEAR(*dataset.entries[1].pose->heading_rad, radians(90.0), 1e-9);
  EXPECT_NEAR(*dataset.entries[1].stamp_s, 2.0, 1e-9);
}

TEST_F(Simulate, WrongValuesAreNamedWithTheirRange) {
  const std::string out = folder / "run";
  const auto line_of = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"simulate", "office", out});
    return refusal(more);
  };
  expect_refusal({"simulate", "castle", out}, "office, ");
  EXPECT_TRUE(contains(line_of({"--grid", "0"}), "--grid is 0; allowed: 0.001 to 1000 metres"));
  EXPECT_TRUE(contains(line_of({"--grid", "nan"}), "--grid"));
  EXPECT_TRUE(contains(line_of({"--random", "0"}), "--random is 0; allowed: 1 to"));
  EXPECT_TRUE(contains(line_of({"--random", "-3"}), "--random"));
  EXPECT_TRUE(contains(line_of({"--grid", "1", "--random", "2"}), "cannot be combined"));
  EXPECT_TRUE(contains(line_of({"--kind", "panorama", "--rows", "0"}), "rows"));
  EXPECT_TRUE(contains(line_of({"--kind", "panorama", "--elevation-low-deg", "50"}),
                       "elevation_low_deg is 50"));
  EXPECT_FALSE(fs::exists(out)) << "refused, but something was written";
}

TEST_F(Simulate, BrokenFilesAreNamed) {
  const std::string out = folder / "run";
  for (const std::string name : {"scene.obj", "scene.world", "scene.glb"}) {
    std::ofstream(folder / name) << "this is no scene <";
    expect_refusal({"simulate", folder / name, out}, name);
  }
  std::ofstream(folder / "way.csv") << "stamp_s,x_m,y_m,heading_deg\n0,1,nan,0\n";
  const auto line = refusal({"simulate", "office", out, "--trajectory", folder / "way.csv"});
  EXPECT_TRUE(contains(line, "way.csv"));
  EXPECT_TRUE(contains(line, "y_m"));
  EXPECT_FALSE(fs::exists(out));
}

TEST_F(Simulate, WhatVariesBuiltInScenesIsRefusedForAFile) {
  const std::string out = folder / "run";
  const std::string mesh = folder / "room.obj";
  // A floor of 4 m x 4 m.
  std::ofstream(mesh) << "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\nf 1 2 3 4\n";
  const std::string world = folder / "room.world";
  std::ofstream(world) << "<sdf version='1.6'><world name='room'/></sdf>\n";
  for (const auto& file : {mesh, world}) {
    for (const std::string flag : {"--scene-seed", "--moved-objects", "--moved-seed"}) {
      const auto line = refusal({"simulate", file, out, "--random", "1", flag, "1"});
      EXPECT_TRUE(contains(line, flag));
      if (flag == "--moved-seed") continue;  // does nothing without --moved-objects anyway
      EXPECT_TRUE(contains(line, file));
      EXPECT_TRUE(contains(line, "built-in"));
    }
  }
  std::ofstream(folder / "run.toml") << "[simulation]\nscene_seed = 2\n";
  expect_refusal({"simulate", mesh, out, "--random", "1", "--config", folder / "run.toml"},
                 "--scene-seed");
  EXPECT_FALSE(fs::exists(out)) << "refused, but something was written";
  // The same file without such a flag is rendered.
  run_well(with_small({"simulate", mesh, out, "--random", "1"}));
}

TEST_F(Simulate, WritesOnlyIntoANewOrEmptyFolder) {
  std::ofstream(folder / "precious.txt") << "mine";
  expect_refusal(with_small({"simulate", "office", folder.path(), "--random", "1"}), "not empty");
  // A folder below a file cannot be made, not even by root.
  const std::string below = folder / "precious.txt/run";
  expect_refusal(with_small({"simulate", "office", below, "--random", "1"}), below);
  EXPECT_EQ(bytes_of(folder / "precious.txt"), "mine");
}

TEST_F(Simulate, AFullDiskLeavesNothingBehind) {
  const std::string out = folder / "run";
  EXPECT_TRUE(contains(refusal({"simulate", "office", out, "--random", "2", "--rays-per-axis", "1"},
                               {.file_size_limit_bytes = 20000, .kill_after_ms = {}}),
                       "view_00000.png"));
  EXPECT_FALSE(fs::exists(out));
}

}  // namespace
}  // namespace panonav::testing
