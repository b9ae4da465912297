// info on everything that verbs take, and on files that none takes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/camera_file.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class Info : public InTemporaryFolder {
 protected:
  static bool takes(const json& described, const std::string& verb) {
    const auto& verbs = described.at("verbs");
    return std::ranges::find(verbs, json(verb)) != verbs.end();
  }
  /// Returns the output of info for an input, which must be of this type.
  static json describe(const fs::path& input, const std::string& type) {
    json said = answer_of({"info", input, "--json"}, 0);
    EXPECT_EQ(said.at("input"), input.string());
    EXPECT_EQ(said.at("type"), type) << said;
    return said;
  }
  static std::string last_line(const fs::path& input) {
    const auto said = lines(run_panonav({"info", input}).out);
    return said.empty() ? "" : said.back();
  }
};

TEST_F(Info, FoldersAndImagesHaveVerbsAndANextCommandThatWorks) {
  const auto world = landmark_world(3);
  const fs::path photos = folder / "photos";
  fs::create_directory(photos);
  for (const char* name : {"a.png", "b.png"}) write_picture(photos / name, world, {}, 96, 48);
  std::ofstream(photos / "notes.txt") << "x";
  const json said = describe(photos, "folder of images");
  EXPECT_EQ(said["images"], 2);
  EXPECT_GT(said["bytes"], 0);
  EXPECT_TRUE(takes(said, "memorise"));
  EXPECT_TRUE(takes(said, "calibrate"));
  EXPECT_FALSE(takes(said, "evaluate"));
  EXPECT_TRUE(contains(said["facts"].dump(), "1 other file or folder in it: not read"));
  EXPECT_EQ(last_line(photos),
            "Next: panonav memorise photos.panonav " + photos.string() + " --kind equirectangular");
  EXPECT_EQ(run_panonav({"info", photos, "--quiet"}).out.find("Next"), std::string::npos);

  const json image = describe(photos / "a.png", "image");
  EXPECT_EQ(image["summary"], "PNG, 96 x 48 px");
  EXPECT_TRUE(takes(image, "localise"));
  run_well({"unwrap", photos / "a.png", "-o", folder / "seen.png", "--kind", "equirectangular"});
  const json strip = describe(folder / "seen.png", "image");
  EXPECT_TRUE(contains(strip["facts"].dump(), "--kind panorama"));

  const fs::path tree = folder / "tree";
  fs::create_directory(tree);
  fs::rename(photos, tree / "photos");
  EXPECT_TRUE(contains(last_line(tree), "--recursive"));
  const json images = describe(tree / "photos", "folder of images");
  for (const char* verb : {"try", "route record", "route follow"})
    EXPECT_TRUE(takes(images, verb)) << verb;
}

TEST_F(Info, DataSetsMemoriesTrajectoriesAndOptions) {
  const fs::path run = folder / "run";
  write_dataset(run, landmark_world(3), {{0.0, 0.0, 0.0}, {0.5, 0.0, 0.0}});
  const json dataset = describe(run, "data set");
  EXPECT_EQ(dataset["images"], 2);
  EXPECT_TRUE(contains(dataset["facts"].dump(), "positions, headings"));
  EXPECT_TRUE(takes(dataset, "route record"));
  EXPECT_EQ(describe(run / "dataset.toml", "data set")["images"], 2) << "by its description";

  const std::string memory = folder / "m.panonav";
  run_well({"memorise", memory, run});
  const auto text = run_panonav({"info", memory});
  const json said = answer_of({"info", memory, "--json"}, 0);
  EXPECT_TRUE(takes(said, "localise"));
  const auto bytes = said["file_bytes"].get<std::uint64_t>();
  EXPECT_TRUE(contains(
      text.out, std::to_string(bytes) + " bytes, " + std::to_string(bytes / 2) + " per view"));
  EXPECT_EQ(lines(text.out).back(), "Next: panonav localise " + memory + " INPUT");

  EXPECT_FALSE(takes(said, "evaluate")) << "a memory without a map";
  const fs::path path = folder.write("path.tum", "# path\n1 0 0 0 0 0 0 1\n3 3 4 0 0 0 0 1\n");
  const json trajectory = describe(path, "trajectory");
  EXPECT_EQ(trajectory["summary"], "2 poses (TUM format) in 2 s over 5 m");
  EXPECT_TRUE(takes(trajectory, "evaluate"));
  expect_refusal({"info", folder.write("back.tum", "2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n")},
                 "line 2: stamp is 1");

  const json options =
      describe(folder.write("o.toml", "[localiser]\ntop = 3\n"), "file of options");
  EXPECT_TRUE(takes(options, "localise"));
  EXPECT_FALSE(takes(options, "memorise"));
  expect_refusal({"info", folder.write("p.toml", "[server]\nport = 3\n")}, "no verb takes");
}

TEST_F(Info, DataSetsOfNarrowPicturesSayWhatTheyAreFor) {
  const fs::path photos = folder / "photos";
  fs::create_directory(photos);
  write_picture(photos / "a.png", landmark_world(3), {}, 96, 48);
  std::ofstream(photos / "dataset.toml")
      << "[images]\nkind = \"pinhole\"\nfield_of_view_deg = 70\n[list]\nfile = \"images.csv\"\n";
  std::ofstream(photos / "images.csv") << "file\na.png\n";
  const json said = describe(photos, "data set");
  EXPECT_EQ(said["summary"], "1 image of 96 x 48 px, pinhole, 70 degrees wide");
  EXPECT_EQ(said["verbs"], json({"localise", "track", "convert"})) << "others need all azimuths";
  const json converted = answer_of({"convert", photos, folder / "photos.mcap", "--json"}, 0);
  EXPECT_EQ(converted["layout_flags"], json({"--kind", "pinhole", "--field-of-view", "70"}));
  EXPECT_EQ(last_line(photos), "Next: panonav localise MEMORY " + photos.string());
}

// The verb evaluate needs a map whose views have stamps.
TEST_F(Info, MemoriesWithAMapAreEvaluatedIfTheirViewsHaveStamps) {
  const fs::path run = folder / "run";
  write_dataset(run, landmark_world(7), grid_poses(4));
  for (const bool has_stamps : {false, true}) {
    SCOPED_TRACE(has_stamps);
    if (has_stamps) {
      std::string table;
      for (const auto& line : lines(bytes_of(run / "poses.csv"))) {
        table += line + (table.empty() ? ",stamp_s" : "," + line.substr(5, 3)) + "\n";
      }
      write_file(run / "poses.csv", std::string_view(table));
    }
    const std::string mapped = folder / (has_stamps ? "stamped.panonav" : "m.panonav");
    run_well({"map", mapped, run});
    EXPECT_TRUE(contains(run_panonav({"info", mapped}).out, "  map         16 views"));
    EXPECT_EQ(takes(answer_of({"info", mapped, "--json"}, 0), "evaluate"), has_stamps);
    const auto evaluated = run_panonav({"evaluate", mapped, run / "poses.csv"});
    EXPECT_EQ(evaluated.exit_code != 2, has_stamps) << evaluated.err;
  }
}

TEST_F(Info, PagesWorldsCamerasAndLiveSources) {
  const json live = answer_of({"info", "rtsp://127.0.0.1:1/none", "--json"}, 0);
  EXPECT_EQ(live["type"], "live source");
  EXPECT_EQ(live["verbs"], json::parse(R"(["localise", "memorise", "track"])"));
  EXPECT_EQ(answer_of({"info", "-", "--json"}, 0)["type"], "live source");

  Camera camera;
  camera.model = EquiangularModel{radians(-60.0), radians(60.0)};
  camera.image_size = {480, 480};
  camera.centre = {240.0, 240.0};
  camera.inner_radius_px = 20.0;
  camera.rim_radius_px = 235.0;
  write_camera(folder / "camera.toml", {camera, {}});
  const json described = describe(folder / "camera.toml", "camera file");
  EXPECT_TRUE(contains(std::string(described["summary"]), "480 x 480 px, model equiangular"));
  EXPECT_TRUE(takes(described, "unwrap --camera")) << described["verbs"];

  const json world =
      describe(folder.write("a.world", "<?xml version='1.0'?>\n<sdf version='1.6'/>"), "scene");
#ifdef PANONAV_COMMAND_SIMULATES
  EXPECT_TRUE(takes(world, "simulate"));
#endif
  const fs::path page = folder / "page";
  fs::create_directory(page);
  std::ofstream(page / "index.html")
      << "<!DOCTYPE html><html><head><meta name=\"generator\" content=\"panonav map\">";
  EXPECT_TRUE(contains(std::string(describe(page, "report")["summary"]), "in a browser"));
}

TEST_F(Info, ImagesThatFfmpegCannotDecodeAreNamedWithTheNextStep) {
  for (const std::string& name : std::vector<std::string>{"photo.webp", "download.jpg"}) {
    const std::string file = folder / name;
    std::ofstream(file, std::ios::binary) << "RIFF\1\2\3\4WEBPVP8 ";
    const std::string line = refusal({"info", file});
    EXPECT_TRUE(contains(line, name + ": is WebP, HEIC or AVIF, and the installed ffmpeg")) << line;
    EXPECT_TRUE(contains(line, "; convert it to PNG or JPEG")) << line;
  }
}

// One line on standard error that says what the content is.
TEST_F(Info, WhatNoVerbTakesIsDescribedInOneLine) {
  using std::string_literals::operator""s;
  const std::vector<std::pair<std::string, std::string>> contents{
      {"", "empty (0 bytes)"},
      {"%PDF-1.4", "PDF"},
      {"GIF89a", "GIF image; convert it"},
      {"II*\0...."s, "TIFF"},
      {"PK\3\4......", "ZIP"},
      {"\x1f\x8b......", "gzip"},
      {"P5\n4 4\n255\n................", "occupancy map"},
      {"P5 4 4 255 ................", "occupancy map"},
      {"\x93NUMPY......", "NumPy"},
      {"{\"file\": 1}\n", "JSON"},
      {"file,x_m,y_m\na.png,1,2\n", "table of a data set"},
      {"Dear diary,\n", "a text that begins with 'Dear diary,'"},
      {"BMW is a car, not an image\n", "a text that begins with 'BMW"},
      {"\x01\x02\0\xff\xfe"s, "binary data"},
  };
  for (const auto& [content, words] : contents) {
    const std::string file = folder / "thing.dat";
    std::ofstream(file, std::ios::binary) << content;
    const std::string line = refusal({"info", file});
    EXPECT_TRUE(contains(line, "thing.dat: no verb takes it; it is "));
    EXPECT_TRUE(contains(line, words));
  }
  fs::create_directory(folder / "empty");
  expect_refusal({"info", folder / "empty"}, "but with nothing");
  fs::create_directories(folder / "worlds/model");
  for (const char* name : {"worlds/model/model.sdf", "worlds/yard.world", "worlds/LICENSE"})
    std::ofstream(folder / name) << "x";
  const std::string worlds = refusal({"info", folder / "worlds"});
  EXPECT_TRUE(contains(worlds, "1 file without an ending, 1 *.world, 1 folder; try panonav info " +
                                   (folder / "worlds/yard.world").string()))
      << worlds;
  std::ofstream(folder / "empty/run.bag") << "";
  expect_refusal({"info", folder / "empty"}, "1 *.bag; try panonav info ");
  expect_refusal({"info", folder / "empty/run.bag"}, "empty (0 bytes)");
  expect_refusal({"info", folder / "nowhere"}, "no such file or folder");
}

TEST_F(Info, FactsOfA360DegreeImage) {
  const auto* data = std::getenv("PANONAV_DATA");
  const fs::path cases = fs::path(data == nullptr ? "" : data).parent_path() / "cases";
  if (data == nullptr || !fs::exists(cases / "rolled_360_with_pose.jpg")) {
    GTEST_SKIP() << "no pictures with GPano data";
  }
  const json rolled = describe(cases / "rolled_360_with_pose.jpg", "image");
  EXPECT_TRUE(contains(rolled["facts"].dump(), "pitch 0 and roll 4 degrees"));
  expect_refusal({"info", cases / "half_sphere_with_crop_data.jpg"}, "a sector of 180 degrees");
}

}  // namespace
}  // namespace panonav::testing
