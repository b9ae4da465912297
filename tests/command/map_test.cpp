#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/mapper.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"
#include "support/recorded_messages.hpp"
#include "support/report_pages.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// One and a quarter rounds of 7.5 m.
std::vector<Pose2> round_trip() {
  std::vector<Pose2> poses;
  for (int i = 0; i < 100; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 80.0;
    poses.push_back({2.0 + 1.2 * std::sin(angle), 2.0 - 1.2 * std::cos(angle), 0.0});
  }
  return poses;
}

class Map : public ::testing::Test {
 protected:
  void SetUp() override { write_dataset(folder_ / "run", landmark_world(3), round_trip()); }
  [[nodiscard]] std::string memory() const { return folder_ / "m.panonav"; }
  [[nodiscard]] json map(const std::vector<std::string>& more = {}) const {
    const auto arguments = with({"map", memory(), folder_ / "run", "--json"}, more);
    const auto result = run_panonav(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    return json::parse(result.out);
  }
  TemporaryFolder folder_;
};

TEST_F(Map, EveryPictureBecomesANodeOfTheMap) {
  const json said = map({"--tum", folder_ / "m.tum", "--graphml", folder_ / "m.graphml"});
  for (const char* key : {"memory", "images", "nodes", "skipped", "connected_components",
                          "closures", "scale_m", "wheels", "step_ms", "ground_truth"}) {
    EXPECT_TRUE(said.contains(key)) << key;
  }
  EXPECT_EQ(said["nodes"], 100);
  EXPECT_EQ(said["wheels"], false);
  EXPECT_EQ(contains(bytes_of(folder_ / "m.tum"), "# unit: view steps\n"),
            said["unit"] == "view_steps");
  std::ifstream tum(folder_ / "m.tum");
  std::size_t lines = 0;
  for (std::string line; std::getline(tum, line);) lines += line.empty() || line[0] == '#' ? 0 : 1;
  EXPECT_EQ(lines, said["connected_components"][0]);
  EXPECT_TRUE(fs::exists(folder_ / "m.graphml"));
  run_well({"verify", memory()});
  // A second time the views are known, and the map is the same.
  json again = map();
  json before = said;
  again.erase("step_ms");
  before.erase("step_ms");
  EXPECT_EQ(again, before);
}

TEST_F(Map, ARecordHoldsTheFinishedMap) {
  const std::string record = folder_ / "map.mcap";
  const json said = map({"--record", record});
  ASSERT_EQ(said["connected_components"].size(), 1U);
  expect_record(record, 100,
                {{"/diagnostics", {"diagnostic_msgs/DiagnosticArray", 100}},
                 {"/edges", {"sensor_msgs/PointCloud2", 1}},
                 {"/ground_truth", {"geometry_msgs/PoseStamped", 100}},
                 {"/references", {"sensor_msgs/PointCloud2", 1}},
                 {"/visited", {"nav_msgs/OccupancyGrid", 1}}});
  for_each_message<recordings::ros::PointCloud2>(
      record, "/references",
      [](const recordings::ros::PointCloud2& cloud) { EXPECT_EQ(cloud.width, 100U); });
  // Ends of all edges at least, closures among them.
  for_each_message<recordings::ros::PointCloud2>(
      record, "/edges", [&](const recordings::ros::PointCloud2& cloud) {
        EXPECT_GE(cloud.width, 2 * (99 + said["closures"].get<unsigned>()));
        std::size_t of_closures = 0;
        for (std::size_t i = 0; i < cloud.width; ++i) {
          float kind = 0.0F;
          std::memcpy(&kind, &cloud.data[16 * i + 12], sizeof(kind));
          of_closures += kind == static_cast<float>(Link::Kind::closure) ? 1 : 0;
        }
        EXPECT_GE(of_closures, 2 * said["closures"].get<std::size_t>());
      });
}

TEST_F(Map, ViewsThatHardlyDifferAreSkipped) {
  const json said = map({"--capture-difference", "0.05"});
  EXPECT_LT(said["nodes"], 100);
  EXPECT_GT(said["nodes"], 5);
  EXPECT_EQ(said["nodes"].get<int>() + said["skipped"].get<int>(), 100);
}

TEST_F(Map, PruneShrinksTheMemoryAndKeepsTheMapWhole) {
  const json said = map();
  const auto dry =
      run_panonav({"prune", memory(), "--dry-run", "--max-difference", "0.05", "--json"});
  ASSERT_EQ(dry.exit_code, 0) << dry.err;
  const auto result = answer_of({"prune", memory(), "--max-difference", "0.05", "--json"});
  EXPECT_EQ(result["views_before"], 100);
  EXPECT_LT(result["views"], 100);
  EXPECT_GT(result["factor"], 1.0);
  EXPECT_EQ(json::parse(dry.out)["views"], result["views"]);
  const auto info = run_panonav({"info", memory(), "--json"});
  EXPECT_EQ(json::parse(info.out)["views"], result["views"]);
  EXPECT_GE(json::parse(info.out)["links"].get<int>(),
            result["views"].get<int>() - static_cast<int>(said["connected_components"].size()));
  run_well({"verify", memory()});
}

TEST_F(Map, TheLibraryMakesTheSameMapOnePictureAtATime) {
  (void)map();
  const auto by_verb = MemoryFile::open(memory(), Access::read_only);
  const auto own = folder_.path() / "own.panonav";
  MemoryFile::create(own, by_verb.header());
  Mapper mapper(own);
  for (const DatasetEntry& entry : read_dataset(folder_.path() / "run").entries) {
    Observation seen(read_image(entry.path));
    seen.name = entry.file;
    seen.pose = entry.pose;
    seen.stamp_s = entry.stamp_s;
    mapper.add(seen);
  }
  const Mapper::Result run = mapper.finish();
  EXPECT_EQ(run.map.nodes.size(), 100U);
  EXPECT_EQ(run.map, *by_verb.map(map_name));
  EXPECT_EQ(mapper.memory().links(), by_verb.links());
  const VisualMemory views = mapper.memory().load();
  const VisualMemory expected = by_verb.load();
  for (const ViewId view : expected.views()) {
    EXPECT_EQ(views.packed(view), expected.packed(view));
    EXPECT_EQ(views.info(view), expected.info(view));
  }
  EXPECT_THROW(mapper.add(Image(97, 12)), ContractError) << "another size than the memory's";
}

TEST_F(Map, SaysWhatItWroteAndWhatAPictureShows) {
  const auto result = run_panonav({"map", memory(), folder_ / "run", "--tum", folder_ / "m.tum",
                                   "--picture", folder_ / "m.svg", "--report", folder_ / "report"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::string page = bytes_of(folder_ / "report/index.html");
  (void)text_of_page(page);
  ASSERT_EQ(panels_of(page).size(), 2U);
  const nlohmann::json run = panels_of(page).front().data;
  EXPECT_GE(run["moments"].size(), 5U);
  EXPECT_FALSE(run["moments"][0].contains("truth")) << "it is in another frame";
  EXPECT_GE(run["retained"]["references"].size(), 4U);
  EXPECT_TRUE(contains(result.out, memory() + " contains the map"));
  EXPECT_TRUE(contains(result.out, std::string(folder_ / "m.tum") + " contains the poses"));
  EXPECT_TRUE(contains(result.out, std::string(folder_ / "m.svg") + " shows the"));
}

TEST_F(Map, AHeightOfTheCameraThatHasNoEffectIsRefused) {
  write_file(folder_ / "run" / "dataset.toml", std::string_view("[images]\nkind = \"panorama\"\n"
                                                                "[poses]\nfile = \"poses.csv\"\n"));
  const auto line = refusal({"map", memory(), folder_ / "run", "--camera-height-m", "0.5"});
  EXPECT_TRUE(contains(line, "elevations")) << line;
  EXPECT_FALSE(fs::exists(memory()));
}

TEST_F(Map, ARecordingWithoutPositionsCanBeMappedAgain) {
  for (const char* table : {"dataset.toml", "poses.csv"})
    fs::remove(folder_.path() / "run" / table);
  const std::vector<std::string> line{"map",    memory(),   folder_ / "run",
                                      "--kind", "panorama", "--elevation-deg",
                                      "-30",    "40",       "--json"};
  const auto first = answer_of(line);
  EXPECT_GT(answer_of({"info", memory(), "--json"})["views_with_position"], 0) << "the map's";
  const auto again = answer_of(line);
  EXPECT_EQ(again["nodes"], first["nodes"]);
  EXPECT_EQ(again["closures"], first["closures"]);
  EXPECT_EQ(again["unit"], "view_steps");
  run_well({"scale", memory(), "--distance", view_name(0), view_name(10), "2m"});
  const auto position = [&] {
    const auto pose = answer_of({"show", memory(), view_name(10), "--json"})["pose"];
    return std::hypot(pose["x_m"].get<double>(), pose["y_m"].get<double>());
  };
  const double before_m = position();
  EXPECT_EQ(answer_of(line)["unit"], "m");
  EXPECT_NEAR(position(), before_m, 1e-6) << "the scale is kept";

  const std::string report = folder_ / "report";
  run_well({"map", folder_ / "steps.panonav", folder_ / "run", "--kind", "panorama",
            "--elevation-deg", "-30", "40", "--report", report});
  const nlohmann::json run = panels_of(bytes_of(report + "/index.html")).front().data;
  EXPECT_EQ(run["retained"]["unit"], "view steps");

  fs::create_directory(folder_.path() / "more");
  for (int i = 0; i < 12; ++i) {
    write_picture(folder_.path() / "more" / ("more" + view_name(i)), landmark_world(3),
                  round_trip()[i]);
  }
  run_well({"memorise", memory(), folder_ / "more"});
  expect_refusal(line, "use panonav memorise");
}

TEST_F(Map, WrongUseIsRefused) {
  expect_refusal({"map", memory(), folder_ / "run", "--scale-m", "0"}, "scale_m");
  EXPECT_FALSE(fs::exists(memory()));
  expect_refusal({"map", memory(), folder_ / "none"}, "none");
  static_cast<void>(map());
  expect_refusal({"map", memory(), folder_ / "run", "--components", "9"},
                 "--components is 9; allowed: 15, as");
  expect_refusal({"prune", folder_ / "none.panonav"}, "none.panonav");
}

TEST(MapOfADrive, TheHeightOfTheCameraTellsMetres) {
  const TemporaryFolder folder;
  const std::string run = folder / "run";
  run_well({"simulate", "loop", run, "--path", "tour", "--heading", "path", "--spacing-m", "0.2",
            "--kind", "panorama", "--columns", "256"});
  const auto scale_with = [&](const std::string& memory, std::vector<std::string> more) {
    std::vector<std::string> arguments{"map",   memory,   run,         "--wheels",
                                       "false", "--json", "--scale-m", "4"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto result = run_panonav(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out)["ground_truth"]["scale"].get<double>();
  };
  // Narrow rooms: what stands on the ground makes lengths up to 15 % too long.
  EXPECT_NEAR(scale_with(folder / "ground.panonav", {"--camera-height-m", "0.6"}), 1.0, 0.2);
  expect_refusal({"map", folder / "wheels.panonav", run, "--camera-height-m", "0.6"}, "odometry");
  EXPECT_LT(scale_with(folder / "guess.panonav", {}), 0.7) << "guard: the guess is wrong";
  // Beside positions in metres, the map keeps its own unit.
  run_well({"map", folder / "steps.panonav", run, "--wheels", "false"});
  for (const auto& [memory, kind] :
       {std::pair{"ground.panonav", "rigid"}, std::pair{"steps.panonav", "similarity"}}) {
    const json errors = answer_of({"evaluate", folder / memory, run + "/poses.csv", "--json"});
    EXPECT_EQ(errors["alignment"]["kind"], kind) << memory;
  }
}

TEST(MapOfADrive, TheHeightOfTheCameraScalesAMapOfImages) {
  const TemporaryFolder folder;
  const fs::path run = folder.path() / "run";
  const std::string memory = folder / "m.panonav";
  run_well({"simulate", "loop", run, "--path", "tour", "--heading", "path", "--spacing-m", "0.2",
            "--kind", "panorama", "--columns", "256"});
  for (const char* table : {"dataset.toml", "poses.csv"}) fs::remove(run / table);
  run_well({"memorise", memory, run, "--kind", "panorama", "--elevation-deg", "-30", "40"});
  const auto step_at_height = [&](const char* height_m) {
    return answer_of({"scale", memory, "--camera-height-m", height_m, "--json"})["view_step_m"]
        .get<double>();
  };
  const double step_m = step_at_height("0.6");
  EXPECT_NEAR(step_m, 0.2, 0.04) << "narrow rooms make lengths up to 15 % too long";
  EXPECT_NEAR(step_at_height("1.2"), 2.0 * step_m, 0.02 * step_m) << "a corrected height";
  EXPECT_EQ(answer_of({"undo", memory, "--json"})["unit"], "m");
  EXPECT_EQ(answer_of({"undo", memory, "--json"})["unit"], "view_steps");
}

}  // namespace
}  // namespace panonav::testing
