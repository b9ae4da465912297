#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "command/room_run.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/route_follower.hpp"
#include "panonav/pipeline/route_recorder.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"
#include "support/recorded_messages.hpp"
#include "support/report_pages.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

double error_m(const json& answer) {
  return std::hypot(
      answer["pose"]["x_m"].get<double>() - answer["ground_truth"]["x_m"].get<double>(),
      answer["pose"]["y_m"].get<double>() - answer["ground_truth"]["y_m"].get<double>());
}

double worst_error_m(const std::vector<json>& all) {
  double worst = 0.0;
  for (const auto& answer : all) worst = std::max(worst, error_m(answer));
  return worst;
}

TEST_F(RouteVerbs, TheSameDriveGoesOnWhereItsRecordingStopped) {
  const std::string whole = bytes_of(folder_ / "teach" / "poses.csv");
  const json at_once = record({"--every-m", "0.05", "--name", "at once"});
  // An interrupted recording leaves the first lines.
  std::string first;
  for (const auto& line : lines(whole)) {
    if (first.size() < whole.size() / 2) first += line + "\n";
  }
  write_file(folder_ / "teach" / "poses.csv", std::string_view(first));
  const json begun = record({"--every-m", "0.05"});
  EXPECT_LT(begun["lines"], at_once["lines"]);
  write_file(folder_ / "teach" / "poses.csv", std::string_view(whole));
  const json ended = record({"--every-m", "0.05"});
  EXPECT_EQ(ended["appended"].get<int>() + begun["lines"].get<int>(), at_once["lines"]);
  EXPECT_EQ(ended["lines"], at_once["lines"]);
  EXPECT_EQ(ended["length_m"], at_once["length_m"]);
  const json again = record({"--every-m", "0.05"});
  EXPECT_EQ(again["appended"], 0);
  EXPECT_EQ(again["left_out"]["known_before"], at_once["lines"]);
}

// Every image that became no line is counted, with the reason.
TEST_F(RouteVerbs, TheImagesThatBecameNoLinesAreCounted) {
  const std::string poses = bytes_of(folder_ / "teach" / "poses.csv");
  std::string some;
  for (const auto& line : lines(poses)) {
    const bool has_pose = !contains(line, "view_1003.") && !contains(line, "view_1004.");
    some += (has_pose ? line
                      : line.substr(0, line.find(',', line.find(',') + 1)) + std::string(6, ',')) +
            "\n";
  }
  write_file(folder_ / "teach" / "poses.csv", std::string_view(some));
  const auto said = run_panonav({"route", "record", folder_ / "m.panonav", folder_ / "teach"});
  EXPECT_EQ(said.exit_code, 0) << said.err;
  EXPECT_TRUE(contains(said.out,
                       "of 81 images, 40 became lines; 39 are nearer to the line before "
                       "than the distance between lines; 2 have no position"))
      << said.out;
}

// Without odometry, the memory's views with positions give the scale, by an estimate.
TEST_F(RouteVerbs, LengthsThatAreEstimatedFromTheViewsAreCalledSo) {
  const fs::path walk = folder_ / "walk";
  write_dataset(walk, landmark_world(7), grid_poses(4));
  const fs::path images = folder_ / "images";
  fs::create_directory(images);
  for (const auto& entry : fs::directory_iterator(walk)) {
    if (entry.path().extension() == ".png") fs::copy(entry.path(), images);
  }
  const std::string memory = folder_ / "walk.panonav";
  run_well({"memorise", memory, walk});
  const std::vector<std::string> kind{"--kind", "panorama", "--elevation-deg", "-20", "20"};
  const auto said =
      run_panonav(with({"route", "record", memory, images, "--name", "a", "--every-m", "0"}, kind));
  EXPECT_EQ(said.exit_code, 0) << said.err;
  EXPECT_TRUE(contains(said.out, "Lengths are estimated from the views of the memory")) << said.out;
  const auto estimated = answer_of(
      with({"route", "record", memory, images, "--name", "b", "--every-m", "0", "--json"}, kind));
  EXPECT_EQ(estimated["length_estimated"], true);
  EXPECT_EQ(record()["length_estimated"], false) << "positions of the data set";
}

TEST_F(RouteVerbs, RecordsALineEveryTenCentimetresAndFollowsToTheCentimetre) {
  const json recorded = record();
  EXPECT_EQ(keys_of(recorded),
            (std::set<std::string>{"memory", "route", "frame", "appended", "lines", "columns",
                                   "length_m", "length_estimated", "bytes", "bytes_per_km",
                                   "file_bytes", "left_out"}));
  EXPECT_EQ(recorded["left_out"]["too_near"], 40) << "every second image is on the way between";
  EXPECT_EQ(recorded["lines"], 41);
  EXPECT_EQ(recorded["appended"], 41);
  EXPECT_EQ(recorded["columns"], 360);
  EXPECT_NEAR(recorded["length_m"].get<double>(), 4.0, 1e-6);
  EXPECT_GT(recorded["bytes"].get<int>(), 1000);
  EXPECT_LE(recorded["bytes_per_km"].get<double>(), 3.6e6);

  const auto info = answer_of({"info", folder_ / "m.panonav", "--json"});
  ASSERT_EQ(info["routes"].size(), 1U);
  EXPECT_EQ(info["routes"][0]["name"], "route");
  EXPECT_EQ(info["routes"][0]["lines"], 41);
  EXPECT_EQ(info["routes"][0]["bytes"], recorded["bytes"]);

  const auto all = answers_of({"route", "follow", folder_ / "m.panonav", folder_ / "repeat",
                               "--tum", folder_ / "way.tum", "--json"});
  ASSERT_EQ(all.size(), 21U);
  EXPECT_EQ(keys_of(all[0]),
            (std::set<std::string>{"file", "stamp_s", "on_route", "pose", "origin", "along_m",
                                   "lateral_m", "correlation", "residual", "covariance", "columns",
                                   "changed", "ground_truth"}));
  EXPECT_EQ(all[0]["origin"], "search");
  for (std::size_t i = 0; i < all.size(); ++i) {
    ASSERT_TRUE(all[i]["on_route"]) << i;
    if (i > 0) {
      EXPECT_EQ(all[i]["origin"], "prediction") << i;
    }
    EXPECT_NEAR(all[i]["pose"]["heading_rad"].get<double>(), 0.15, radians(0.5));
    EXPECT_NEAR(all[i]["along_m"].get<double>(), all[i]["ground_truth"]["along_m"].get<double>(),
                0.02);
    EXPECT_NEAR(all[i]["lateral_m"].get<double>(), all[i]["pose"]["y_m"].get<double>(), 1e-6);
    EXPECT_TRUE(all[i]["changed"].empty()) << all[i]["changed"];
  }
  EXPECT_LT(worst_error_m(all), 0.02);
  const auto way = read_trajectory(folder_ / "way.tum");
  ASSERT_EQ(way.size(), 21U);
  EXPECT_NEAR(way[20].stamp_s, 2.0, 1e-9);
  EXPECT_NEAR(way[20].pose.x_m, all[20]["pose"]["x_m"].get<double>(), 1e-6);

  const auto alone = answers_of(
      {"route", "follow", folder_ / "m.panonav", folder_ / "repeat", "--no-odometry", "--json"});
  ASSERT_EQ(alone.size(), 21U);
  for (const auto& answer : alone) EXPECT_EQ(answer["origin"], "search");
  EXPECT_LT(worst_error_m(alone), 0.02);
}

TEST_F(RouteVerbs, ARecordHoldsTheRouteAndTheFixes) {
  record();
  const std::string file = folder_ / "follow.mcap";
  const auto answers = answers_of(
      {"route", "follow", folder_ / "m.panonav", folder_ / "repeat", "--json", "--record", file});
  const auto topics = topics_of(file);
  EXPECT_EQ(topics.at("/plan"), (std::pair<std::string, std::uint64_t>{"nav_msgs/Path", 1}));
  EXPECT_EQ(topics.at("/diagnostics").second, answers.size());
  for_each_message<recordings::ros::Path>(
      file, "/plan", [](const recordings::ros::Path& way) { EXPECT_EQ(way.poses.size(), 41U); });
  std::vector<Pose2> poses;
  for_each_message<recordings::ros::PoseWithCovarianceStamped>(
      file, "/pose", [&](const recordings::ros::PoseWithCovarianceStamped& pose) {
        EXPECT_GT(pose.pose.covariance[0], 0.0);
        poses.push_back(recordings::ros::to_pose2(pose.pose.pose));
      });
  std::size_t fixes = 0;
  for (const json& answer : answers) {
    if (!answer["on_route"].get<bool>()) continue;
    ASSERT_LT(fixes, poses.size());
    EXPECT_EQ(poses[fixes++].x_m, answer["pose"]["x_m"]);
  }
  EXPECT_EQ(fixes, poses.size());
  EXPECT_GE(fixes, answers.size() / 2);
}

TEST_F(RouteVerbs, ARouteGrowsWhereItEndsAndNowhereElse) {
  (void)record();
  write_room_run(folder_ / "on", room_, straight({2.1, 0.0}, 0.0, 0.5, 0.1));
  const auto grown =
      answer_of({"route", "record", folder_ / "m.panonav", folder_ / "on", "--json"});
  EXPECT_EQ(grown["appended"], 6);
  EXPECT_EQ(grown["lines"], 47);
  EXPECT_NEAR(grown["length_m"].get<double>(), 4.6, 1e-6);

  expect_refusal({"route", "record", folder_ / "m.panonav", folder_ / "teach"},
                 "from the end of the route 'route'");
  const auto other =
      refusal({"route", "record", folder_ / "m.panonav", folder_ / "on", "--columns", "180"});
  EXPECT_TRUE(contains(other, "--columns"));
  const auto wheels =
      refusal({"route", "record", folder_ / "m.panonav", folder_ / "on", "--odometry"});
  EXPECT_TRUE(contains(wheels, "frame"));

  const auto second = record({"--name", "by wheels", "--odometry", "--every-m", "0.2"});
  EXPECT_EQ(second["lines"], 21);  // 4.08 m by the wheels, 0.204 m apart
  expect_refusal({"route", "follow", folder_ / "m.panonav", folder_ / "repeat"},
                 "choose one with --name: by wheels, route");
  expect_refusal({"route", "follow", folder_ / "m.panonav", folder_ / "repeat", "--name", "other"},
                 "contains no route 'other'");
  const auto by_wheels = answers_of({"route", "follow", folder_ / "m.panonav", folder_ / "repeat",
                                     "--name", "by wheels", "--json"});
  ASSERT_EQ(by_wheels.size(), 21U);
  for (const auto& answer : by_wheels) {
    EXPECT_TRUE(answer["on_route"]);
    EXPECT_TRUE(answer["ground_truth"].is_null());  // another frame
  }
}

TEST_F(RouteVerbs, ImagesThatDoNotFitTheMemoryAreRefused) {
  (void)record();
  const std::string toml = bytes_of(folder_ / "repeat/dataset.toml");
  write_room_run(folder_ / "other", room_, straight({-1.2, -0.2}, 0.15, 2.0, 0.1));
  const std::size_t at = toml.find("elevation_deg = [");
  ASSERT_NE(at, std::string::npos) << toml;
  const std::string band =
      toml.substr(0, at) + "elevation_deg = [-20, 20]" + toml.substr(toml.find(']', at) + 1);
  write_file(folder_ / "other/dataset.toml", std::string_view(band));
  const std::vector<std::string> follow{"route", "follow", folder_ / "m.panonav",
                                        folder_ / "other"};
  expect_refusal(follow, "elevation band is -20 to 20 degrees");
  expect_refusal(follow, "; set --elevation-deg to the band of these images, or store");
  expect_refusal({"route", "record", folder_ / "m.panonav", folder_ / "other", "--name", "b"},
                 "elevation band is -20 to 20 degrees");
  fs::remove(folder_ / "other/dataset.toml");
  fs::remove(folder_ / "other/poses.csv");
  const Image tall(360, 90);
  for (const auto& file : fs::directory_iterator(folder_ / "other")) {
    if (file.path().extension() == ".png") write_png(file.path(), tall.view());
  }
  expect_refusal(follow, "size is 360 x 90; allowed: 360 x 3");
  expect_refusal(follow, "in a memory of their own");
}

TEST_F(RouteVerbs, ElsewhereIsNotOnThisRoute) {
  (void)record();
  write_room_run(folder_ / "elsewhere", pillared_room(77), straight({-1.0, 0.0}, 0.3, 1.0, 0.1));
  const auto all =
      answers_of({"route", "follow", folder_ / "m.panonav", folder_ / "elsewhere", "--json"}, 1);
  ASSERT_EQ(all.size(), 11U);
  for (const auto& answer : all) {
    EXPECT_FALSE(answer["on_route"]);
    EXPECT_TRUE(answer["pose"].is_null());
  }
}

TEST_F(RouteVerbs, NamesWhatHasChanged) {
  (void)record();
  ToyWorld changed = room_;
  changed.move_pillar({0.5, 0.0});
  write_room_run(folder_ / "changed", changed, straight({-1.5, 0.0}, 0.0, 3.0, 0.05));
  const auto all =
      answers_of({"route", "follow", folder_ / "m.panonav", folder_ / "changed", "--json"});
  ASSERT_EQ(all.size(), 61U);
  int named = 0;
  for (const auto& answer : all) {
    ASSERT_TRUE(answer["on_route"]);
    for (const auto& range : answer["changed"]) {
      const double width =
          wrap_angle(range["to_rad"].get<double>() - range["from_rad"].get<double>());
      EXPECT_GT(width, 0.0);
      EXPECT_LT(width, 1.6);
      ++named;
    }
  }
  EXPECT_GE(named, 10);
  EXPECT_LT(worst_error_m(all), 0.04);
}

TEST_F(RouteVerbs, TheLibraryRecordsAndFollowsTheSameOnePictureAtATime) {
  (void)record();
  const auto memory = MemoryFile::open(folder_ / "m.panonav", Access::read_only);
  const auto own = folder_.path() / "own.panonav";
  MemoryFile::create(own, memory.header());
  RouteRecorder recorder(own);
  for (const DatasetEntry& entry : read_dataset(folder_.path() / "teach").entries) {
    (void)recorder.add(read_observation(entry));
  }
  EXPECT_EQ(recorder.finish().route, *memory.route("route"));
  EXPECT_FALSE(recorder.add(Image(360, 3))) << "without a pose";

  const auto said = answers_of({"route", "follow", own.string(), folder_ / "repeat", "--json"});
  const auto repeat = read_dataset(folder_.path() / "repeat");
  ASSERT_EQ(said.size(), repeat.entries.size());
  RouteFollower follower(own);
  for (std::size_t i = 0; i < said.size(); ++i) {
    const RouteFollower::Step step = follower.step(read_observation(repeat.entries[i]));
    ASSERT_TRUE(step.fix);
    EXPECT_EQ(said[i]["pose"]["x_m"].get<double>(), step.fix->pose.x_m);
    EXPECT_EQ(said[i]["pose"]["y_m"].get<double>(), step.fix->pose.y_m);
    EXPECT_EQ(said[i]["lateral_m"].get<double>(), step.fix->lateral_m);
  }
}

TEST_F(RouteVerbs, WrongUseIsRefused) {
  expect_refusal({"route"}, "route record, route follow");
  expect_refusal({"route", "draw"}, "route record, route follow");
  const std::string memory = folder_ / "m.panonav";
  expect_refusal({"route", "follow", memory, folder_ / "repeat"}, memory);
  (void)record();
  const auto rows = refusal(
      {"route", "record", memory, folder_ / "teach", "--name", "b", "--horizon-rows", "1-2"});
  EXPECT_TRUE(
      contains(rows, "--horizon-rows can only be used with panoramas of unknown elevations"));
  expect_refusal({"route", "record", memory, folder_ / "teach", "--horizon-rows", "2-1"},
                 "FIRST-LAST");
  const auto help = run_panonav({"route", "record", "--help-all"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_TRUE(contains(help.out, "--half-band-rad"));
  run_well({"route", "--help"});
}

TEST_F(RouteVerbs, ReportsShowTheRouteAndTheFixes) {
  (void)record({"--report", folder_ / "recorded"});
  run_well({"route", "follow", folder_ / "m.panonav", folder_ / "repeat", "--report",
            folder_ / "followed"});
  using Titles = std::vector<std::string>;
  const std::string recorded = bytes_of(folder_ / "recorded/index.html");
  (void)text_of_page(recorded);
  EXPECT_EQ(plots_of(recorded),
            (Titles{"The route panorama: each row is the horizon at one place", "Map"}));
  const std::string followed = bytes_of(folder_ / "followed/index.html");
  // The words of the answers are explained on the page and in the text.
  const auto said = run_panonav({"route", "follow", folder_ / "m.panonav", folder_ / "repeat"});
  for (const auto& text : {text_of_page(followed), said.out}) {
    for (const char* word :
         {"predicted: at the pose", "recovered: by a search", "found: by a search"}) {
      EXPECT_TRUE(contains(text, word)) << text;
    }
  }
  EXPECT_EQ(
      plots_of(followed),
      (Titles{"Map", "Seen by the robot (upper band) and predicted from the route (lower band)",
              "Correlation of seen and predicted lines", "Errors"}));
  const json run = panels_of(followed).front().data;
  ASSERT_GE(run["moments"].size(), 5U);
  ASSERT_EQ(run["route"]["marks"].size(), run["moments"].size());
  for (std::size_t i = 0; i < run["moments"].size(); ++i) {
    const json& along = run["route"]["marks"][i][0];
    if (along.is_null()) continue;
    EXPECT_EQ(format_fixed(along.get<double>(), 3), run["moments"][i]["values"]["along_m"]);
  }
  for (const auto& panel : panels_of(followed)) {
    if (!panel.data.contains("image")) continue;
    const auto bytes = bytes_of_url(panel.data["image"].get<std::string>());
    EXPECT_GE(decode_image(bytes, "lines").width(), 50);
  }
}

/// A data set without its every tenth row; pictures are linked.
void link_part(const fs::path& from, const fs::path& to) {
  fs::create_directories(to);
  fs::copy_file(from / "dataset.toml", to / "dataset.toml");
  std::ifstream in(from / "poses.csv");
  std::ofstream out(to / "poses.csv");
  std::string line;
  std::getline(in, line);
  out << line << '\n';
  for (int i = 0; std::getline(in, line); ++i) {
    if (i % 10 == 0) continue;
    out << line << '\n';
    const std::string file = line.substr(0, line.find(','));
    fs::create_symlink(fs::absolute(from / file), to / file);
  }
}

// 455 real views outdoors along 7 m; every tenth is remembered, the others are found along the way,
// each alone. The nearest signature is off by 4.9 cm in the median.
TEST(RealRoute, SussexFollowedToThreeCentimetres) {
  const auto data = real_data("sussex_route");
  PANONAV_REQUIRE_DATA(data, "sussex_route");
  const TemporaryFolder folder;
  const auto recorded = answer_of({"route", "record", folder / "m.panonav", data->string(),
                                   "--every", "10", "--every-m", "0", "--json"});
  ASSERT_GE(recorded["lines"].get<int>(), 45);
  link_part(*data, folder / "others");
  const auto all =
      answers_of({"route", "follow", folder / "m.panonav", folder / "others", "--json"});
  ASSERT_EQ(all.size(), 409U);
  std::vector<double> along_m;
  std::vector<double> lateral_m;
  for (const auto& answer : all) {
    if (!answer["on_route"]) continue;
    along_m.push_back(std::abs(answer["along_m"].get<double>() -
                               answer["ground_truth"]["along_m"].get<double>()));
    lateral_m.push_back(std::abs(answer["lateral_m"].get<double>() -
                                 answer["ground_truth"]["lateral_m"].get<double>()));
  }
  // Positions past the ends explain some images from within 0.4 m of these as well.
  EXPECT_GE(along_m.size(), 389U);  // 95 %
  EXPECT_LE(median(along_m), 0.03);
  EXPECT_LE(quantile(along_m, 0.95), 0.15);
  EXPECT_LE(quantile(lateral_m, 0.95), 0.05);
}

}  // namespace
}  // namespace panonav::testing
