#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "command_runner.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Small pictures, so that a test takes no time to speak of.
const std::vector<std::string> small{"--kind",    "panorama", "--rows",          "8",
                                     "--columns", "32",       "--rays-per-axis", "1"};

std::vector<std::string> with_small(std::vector<std::string> arguments) {
  arguments.insert(arguments.end(), small.begin(), small.end());
  return arguments;
}

std::set<std::string> keys_of(const json& object) {
  std::set<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.insert(key);
  return keys;
}

std::string bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

TEST(Simulate, WritesADataSetThatSaysWhereEachViewWasTaken) {
  const TemporaryFolder folder;
  const auto out = folder / "run";
  const auto result = run_panonav(with_small({"simulate", "office", out, "--grid", "1", "--json"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto said = json::parse(result.out);
  EXPECT_EQ(keys_of(said), (std::set<std::string>{"dataset", "scene", "views", "free_area_m2"}));
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

TEST(Simulate, ArenaOnAGridNeedsNoFurtherFlags) {
  const TemporaryFolder folder;
  const auto out = folder / "run";
  const auto result = run_panonav({"simulate", "arena", out, "--grid", "0.4"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
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

TEST(Simulate, SameSeedSamePicturesOtherSeedOthers) {
  const TemporaryFolder folder;
  const auto run = [&](const std::string& name, const std::string& seed) {
    const auto out = folder / name;
    EXPECT_EQ(run_panonav(with_small({"simulate", "lab", out, "--random", "2", "--seed", seed}))
                  .exit_code,
              0);
    return bytes_of(fs::path(out) / "view_00000.png") + bytes_of(fs::path(out) / "view_00001.png") +
           bytes_of(fs::path(out) / "poses.csv");
  };
  const auto first = run("a", "7");
  EXPECT_GT(first.size(), 300U);
  EXPECT_EQ(first, run("b", "7"));
  EXPECT_NE(first, run("c", "8"));
}

TEST(Simulate, FollowsATrajectory) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "way.csv") << "stamp_s,x_m,y_m,heading_deg\n"
                                              "0,1,1,0\n2,1.5,1,90\n";
  const auto out = folder / "run";
  const auto result =
      run_panonav(with_small({"simulate", "office", out, "--trajectory", folder / "way.csv"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Dataset dataset = read_dataset(out);
  ASSERT_EQ(dataset.entries.size(), 2U);
  EXPECT_NEAR(dataset.entries[1].pose->x_m, 1.5, 1e-9);
  EXPECT_NEAR(*dataset.entries[1].pose->heading_rad, radians(90.0), 1e-9);
  EXPECT_NEAR(*dataset.entries[1].stamp_s, 2.0, 1e-9);
}

TEST(Simulate, WrongValuesAreNamedWithTheirRange) {
  const TemporaryFolder folder;
  const auto out = folder / "run";
  const auto line_of = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"simulate", "office", out});
    return refusal(more);
  };
  EXPECT_NE(refusal({"simulate", "castle", out}).find("office, "), std::string::npos);
  EXPECT_NE(line_of({"--grid", "0"}).find("--grid is 0; allowed: > 0"), std::string::npos);
  EXPECT_NE(line_of({"--grid", "nan"}).find("--grid"), std::string::npos);
  EXPECT_NE(line_of({"--random", "0"}).find("--random is 0; allowed: 1 to"), std::string::npos);
  EXPECT_NE(line_of({"--random", "-3"}).find("--random"), std::string::npos);
  EXPECT_NE(line_of({"--grid", "1", "--random", "2"}).find("exclude each other"),
            std::string::npos);
  EXPECT_NE(line_of({"--kind", "panorama", "--rows", "0"}).find("rows"), std::string::npos);
  EXPECT_NE(
      line_of({"--kind", "panorama", "--elevation-low-deg", "50"}).find("elevation_low_deg is 50"),
      std::string::npos);
  EXPECT_FALSE(fs::exists(out)) << "refused, but something was written";
}

TEST(Simulate, BrokenFilesAreNamed) {
  const TemporaryFolder folder;
  const auto out = folder / "run";
  for (const std::string name : {"scene.obj", "scene.world", "scene.glb"}) {
    std::ofstream(folder.path() / name) << "this is no scene <";
    EXPECT_NE(refusal({"simulate", folder / name, out}).find(name), std::string::npos);
  }
  std::ofstream(folder.path() / "way.csv") << "stamp_s,x_m,y_m,heading_deg\n0,1,nan,0\n";
  const auto line = refusal({"simulate", "office", out, "--trajectory", folder / "way.csv"});
  EXPECT_NE(line.find("way.csv"), std::string::npos) << line;
  EXPECT_NE(line.find("y_m"), std::string::npos) << line;
  EXPECT_FALSE(fs::exists(out));
}

TEST(Simulate, WhatVariesBuiltInScenesIsRefusedForAFile) {
  const TemporaryFolder folder;
  const auto out = folder / "run";
  const auto mesh = folder / "room.obj";
  // A floor of 4 m x 4 m.
  std::ofstream(mesh) << "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\nf 1 2 3 4\n";
  const auto world = folder / "room.world";
  std::ofstream(world) << "<sdf version='1.6'><world name='room'/></sdf>\n";
  for (const auto& file : {mesh, world}) {
    for (const std::string flag : {"--scene-seed", "--moved-objects", "--moved-seed"}) {
      const auto line = refusal({"simulate", file, out, "--random", "1", flag, "1"});
      EXPECT_NE(line.find(flag), std::string::npos) << line;
      EXPECT_NE(line.find(file), std::string::npos) << line;
      EXPECT_NE(line.find("built-in"), std::string::npos) << line;
    }
  }
  std::ofstream(folder.path() / "run.toml") << "[simulation]\nscene_seed = 2\n";
  const auto line =
      refusal({"simulate", mesh, out, "--random", "1", "--config", folder / "run.toml"});
  EXPECT_NE(line.find("--scene-seed"), std::string::npos) << line;
  EXPECT_FALSE(fs::exists(out)) << "refused, but something was written";
  // The same file without such a flag is rendered.
  const auto result = run_panonav(with_small({"simulate", mesh, out, "--random", "1"}));
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST(Simulate, WritesOnlyIntoANewOrEmptyFolder) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "precious.txt") << "mine";
  const auto line = refusal(with_small({"simulate", "office", folder.path(), "--random", "1"}));
  EXPECT_NE(line.find("not empty"), std::string::npos) << line;
  // A folder below a file cannot be made, not even by root.
  const auto below = folder / "precious.txt/run";
  EXPECT_NE(refusal(with_small({"simulate", "office", below, "--random", "1"})).find(below),
            std::string::npos);
  EXPECT_EQ(bytes_of(folder.path() / "precious.txt"), "mine");
}

TEST(Simulate, AFullDiskLeavesNothingBehind) {
  const TemporaryFolder folder;
  const auto out = folder / "run";
  const auto line = refusal({"simulate", "office", out, "--random", "2", "--rays-per-axis", "1"},
                            {.file_size_limit_bytes = 20000, .kill_after_ms = {}});
  EXPECT_NE(line.find("view_00000.png"), std::string::npos) << line;
  EXPECT_FALSE(fs::exists(out));
}

}  // namespace
}  // namespace panonav::testing
