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

/// A node that contains itself: the packaged reader follows it until its stack ends.
constexpr std::string_view cyclic_mesh = R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><up_axis>Z_UP</up_axis></asset>
<library_nodes><node id="a" name="a"><instance_node url="#a"/></node></library_nodes>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_node url="#a"/></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";

TEST_F(Simulate, AMeshThatCrashesItsReaderGivesOneLine) {
  const auto mesh = folder.write("cycle.dae", cyclic_mesh);
  const auto line = refusal({"simulate", mesh, folder / "out", "--grid", "1"});
  EXPECT_TRUE(contains(line, mesh.string() + ": is damaged: the reader of its format crashes"));
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST_F(Simulate, AWorldLoadsWithoutTheMeshesThatCrashTheirReader) {
  const auto visual = [](const std::string& name, const std::string& shape) {
    return "<visual name='" + name + "'><geometry>" + shape + "</geometry></visual>";
  };
  const auto crashing = [&](const std::string& name) {
    folder.write(name, cyclic_mesh);
    return visual(name, "<mesh><uri>" + name + "</uri></mesh>");
  };
  const std::string broken = crashing("first.dae") + crashing("second.dae");
  const auto write = [&](const std::string& name, const std::string& visuals) {
    return folder.write(name + ".world",
                        "<sdf version='1.6'><world name='w'><model name='m'><link "
                        "name='l'>" +
                            visuals + "</link></model></world></sdf>");
  };
  const auto world = write("damaged", broken + visual("floor", "<box><size>3 3 0.02</size></box>"));
  const auto result =
      run_panonav({"simulate", world, folder / "run", "--grid", "1", "--kind", "panorama"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const std::string& name : std::vector<std::string>{"first.dae", "second.dae"}) {
    EXPECT_TRUE(contains(result.err, "visual \"" + name + "\" is left out: ")) << result.err;
    EXPECT_TRUE(contains(result.err, name + ": is damaged: the reader of its format crashes on it"))
        << result.err;
  }
  EXPECT_GE(read_dataset(folder / "run").entries.size(), 4U);
  EXPECT_TRUE(contains(refusal({"simulate", write("empty", broken), folder / "out", "--grid", "1"}),
                       "shows nothing: no visual with a shape"));
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

/// A world with a ground plane of 100 m and `more`.
std::string ground_world(const std::string& more) {
  return "<sdf version='1.6'><world name='w'><model name='ground'><link name='l'><visual "
         "name='v'><geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>"
         "</visual></link></model>" +
         more + "</world></sdf>";
}

std::string box_model(const std::string& name, const std::string& pose, const std::string& size) {
  return "<model name='" + name + "'><pose>" + pose +
         "</pose><link name='l'><visual name='v'><geometry><box><size>" + size +
         "</size></box></geometry></visual></link></model>";
}

TEST_F(Simulate, RobotsStandOutsideOfSolidsOnTheGround) {
  const auto positions = [&](const std::string& name, const std::string& more) {
    const auto world = folder.write(name + ".world", ground_world(more));
    run_well(with_small({"simulate", world, folder / name, "--random", "20"}));
    return read_dataset(folder / name).entries;
  };
  for (const auto& entry : positions("big", box_model("table", "0 0 0.4 0 0 0", "3 4 0.8"))) {
    EXPECT_GT(std::max(std::abs(entry.pose->x_m) - 1.5, std::abs(entry.pose->y_m) - 2.0), 0.2);
  }
  std::set<std::pair<bool, bool>> sides;
  for (const auto& entry : positions("small", box_model("table", "0.4 0 0.4 0 0 0", "0.3 0.4 0.8")))
    sides.insert({entry.pose->x_m > 0.4, entry.pose->y_m > 0.0});
  EXPECT_EQ(sides.size(), 4U) << "all around the table";
}

TEST_F(Simulate, TheCameraStandsOnTheFloorThatIsFound) {
  // A wall of 10 m on a slab, and the same on the ground: alike but for the ground around the slab.
  const auto image = [&](const std::string& name, const std::string& more) {
    std::ofstream(folder / "way.csv") << "stamp_s,x_m,y_m,heading_deg\n0,0,0,0\n";
    const auto world = folder.write(name + ".world", ground_world(more));
    run_well({"simulate", world, folder / name, "--trajectory", folder / "way.csv", "--kind",
              "panorama", "--rows", "35", "--columns", "32"});
    return read_image(fs::path(folder / name) / "view_00000.png");
  };
  const Image raised = image("raised", box_model("slab", "0 0 0.1 0 0 0", "20 20 0.2") +
                                           box_model("wall", "4 0 0.7 0 0 0", "0.1 19 1"));
  const Image level = image("level", box_model("slab", "0 0 -0.1 0 0 0", "20 20 0.2") +
                                         box_model("wall", "4 0 0.5 0 0 0", "0.1 19 1"));
  // The wall ahead: its upper edge at 5.7 degrees, its lower one at 8.5 degrees below the horizon.
  double difference = 0.0;
  for (int row = 0; row < 35; ++row) difference += std::abs(raised.at(16, row) - level.at(16, row));
  EXPECT_LT(difference / 35.0, 12.0);
  EXPECT_GT(std::abs(level.at(16, 12) - level.at(16, 19)), 20) << "the wall is not seen";
}

TEST_F(Simulate, RobotsFollowAHeightmapAndANoticeStatesItsSlope) {
  Image heights(65, 65);  // rises by 2 m over 20 m to the east
  for (int v = 0; v < 65; ++v) {
    for (int u = 0; u < 65; ++u) heights.at(u, v) = static_cast<std::uint8_t>(2 * u);
  }
  write_png(folder / "heights.png", heights.view());
  const auto world = folder.write(
      "land.world",
      "<sdf version='1.6'><world name='land'><model name='land'><link name='l'><visual name='v'>"
      "<geometry><heightmap><uri>heights.png</uri><size>20 20 2</size></heightmap></geometry>"
      "</visual></link></model></world></sdf>");
  const auto answer =
      answer_of(with_small({"simulate", world, folder / "run", "--random", "20", "--json"}));
  ASSERT_EQ(answer["warnings"].size(), 1U);
  EXPECT_TRUE(contains(answer["warnings"][0].get<std::string>(),
                       "land.world: the ground slopes by up to 6 degrees"));
  EXPECT_GT(answer["free_area_m2"].get<double>(), 350.0);
  double low_m = 10.0;
  double high_m = -10.0;
  for (const auto& entry : read_dataset(folder / "run").entries) {
    low_m = std::min(low_m, entry.pose->x_m);
    high_m = std::max(high_m, entry.pose->x_m);
  }
  EXPECT_LT(low_m, -5.0);
  EXPECT_GT(high_m, 5.0);
}

TEST_F(Simulate, WarningsOfAWorldComeBeforeItsFailure) {
  const auto world =
      folder.write("room.world", ground_world("<include><uri>model://not_here</uri></include>" +
                                              box_model("table", "0 0 0.4 0 0 0", "3 4 0.8")));
  const auto result = run_panonav(
      with_small({"simulate", world, folder / "out", "--random", "1", "--robot-radius-m", "10"}));
  EXPECT_EQ(result.exit_code, 2);
  const auto warning =
      result.err.find("warning: " + world.string() + ": include \"model://not_here");
  const auto failure = result.err.find("the robot stands nowhere");
  ASSERT_NE(warning, std::string::npos) << result.err;
  ASSERT_NE(failure, std::string::npos) << result.err;
  EXPECT_LT(warning, failure);
  for (const char* option : {"--floor-height-m", "--cell-m", "--robot-radius-m"}) {
    EXPECT_TRUE(contains(result.err.substr(failure), option)) << result.err;
    EXPECT_TRUE(contains(run_panonav({"simulate", "--help-all"}).out, option)) << option;
  }
}

TEST_F(Simulate, EquirectangularImagesAreMemorisedAndLocalised) {
  const auto record = [&](const std::string& name, const std::vector<std::string>& more) {
    run_well(with({"simulate", "office", folder / name, "--kind", "equirectangular", "--columns",
                   "256", "--rays-per-axis", "1"},
                  more));
    return read_dataset(folder / name);
  };
  const Dataset places = record("places", {"--grid", "1"});
  EXPECT_EQ(places.source.kind, PictureKind::equirectangular);
  const Image image = read_image(places.entries[0].path);
  EXPECT_EQ(image.size(), (ImageSize{256, 128}));
  const std::string bytes = bytes_of(places.entries[0].path);
  EXPECT_EQ(bytes.substr(0, 2), "\xFF\xD8");
  for (const char* property :
       {"GPano:ProjectionType=\"equirectangular\"", "GPano:FullPanoWidthPixels=\"256\"",
        "GPano:FullPanoHeightPixels=\"128\"", "GPano:CroppedAreaImageWidthPixels=\"256\"",
        "GPano:CroppedAreaImageHeightPixels=\"128\"", "GPano:CroppedAreaLeftPixels=\"0\"",
        "GPano:CroppedAreaTopPixels=\"0\"", "GPano:PoseHeadingDegrees=\"90\""}) {
    EXPECT_TRUE(contains(bytes, property)) << property;
  }
  EXPECT_FALSE(contains(bytes, "GPano:PosePitchDegrees"));
  // The same view as a panorama of the band that is kept.
  run_well({"simulate", "office", folder / "band", "--grid", "1", "--kind", "panorama", "--columns",
            "256", "--rows", "50", "--rays-per-axis", "1"});
  const Dataset band = read_dataset(folder / "band");
  const Panorama of_sphere =
      PanoramaReader(places.source, {.rows = 50}).read(places.entries[0].path);
  const Panorama of_band = PanoramaReader(band.source, {}).read(band.entries[0].path);
  ASSERT_EQ(of_sphere.values().size(), of_band.values().size());
  double difference = 0.0;
  for (std::size_t i = 0; i < of_band.values().size(); ++i)
    difference += std::abs(of_sphere.values()[i] - of_band.values()[i]);
  EXPECT_LT(difference / static_cast<double>(of_band.values().size()), 0.02);
  run_well({"memorise", folder / "office.panonav", folder / "places"});
  const Dataset queries = record("queries", {"--random", "5", "--seed", "3"});
  int near = 0;
  for (const auto& entry : queries.entries) {
    const auto said = answer_of({"localise", folder / "office.panonav", entry.path, "--json"});
    if (!said["known"].get<bool>()) continue;
    const auto& position = said["position"];
    const double error_m = std::hypot(position["x_m"].get<double>() - entry.pose->x_m,
                                      position["y_m"].get<double>() - entry.pose->y_m);
    if (error_m < 1.5) ++near;
  }
  EXPECT_GE(near, 4);
  expect_refusal(
      {"simulate", "office", folder / "odd", "--kind", "equirectangular", "--columns", "255"},
      "columns is 255");
  expect_refusal(
      {"simulate", "office", folder / "odd", "--kind", "equirectangular", "--rows", "50"},
      "--rows");
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

TEST_F(Simulate, PosesWhereNoRobotCanBeAreCounted) {
  std::ofstream(folder / "way.csv") << "stamp_s,x_m,y_m,heading_deg\n"
                                       "0,1,1,0\n1,1.5,1,0\n2,100,1,0\n3,-90,0,0\n4,0,0,0\n";
  const auto world =
      folder.write("table.world", ground_world(box_model("table", "0 0 0.4 0 0 0", "0.4 0.4 0.8")));
  const auto said = run_panonav(with_small(
      {"simulate", world, folder / "run", "--trajectory", folder / "way.csv", "--json"}));
  EXPECT_EQ(said.exit_code, 0) << said.err;
  const std::string expected =
      "way.csv: the robot cannot be at 3 of 5 poses (2 outside of the floor, x -";
  EXPECT_TRUE(contains(said.err, expected)) << said.err;
  EXPECT_TRUE(contains(said.err, "; 1 inside of an obstacle, within ")) << said.err;
  EXPECT_TRUE(contains(json::parse(said.out)["warnings"].dump(), expected)) << said.out;
  std::ofstream(folder / "way.csv") << "stamp_s,x_m,y_m,heading_deg\n0,1,1,0\n1,1.5,1,0\n";
  const auto free = run_panonav(
      with_small({"simulate", world, folder / "free", "--trajectory", folder / "way.csv"}));
  EXPECT_FALSE(contains(free.err, "cannot be at")) << free.err;
}

TEST_F(Simulate, AWorldWithoutATourNamesTheOtherPaths) {
  expect_refusal(
      {"simulate", folder.write("a.world", ground_world("")), folder / "run", "--path", "tour"},
      "for other scenes use --path walk, --path zigzag, --grid or --trajectory");
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
