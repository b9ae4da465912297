#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "panonav/geometry/angles.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"
#include "support/report_pages.hpp"

namespace panonav::testing {
namespace {

using nlohmann::json;

class Catchment : public ::testing::Test {
 protected:
  Catchment() {
    auto poses = grid_poses(5);
    for (Pose2& pose : poses) pose = {0.2 * pose.x_m, 0.2 * pose.y_m, 0.3};
    std::filesystem::create_directory(run);
    write_dataset(run, world, poses);
  }
  TemporaryFolder folder;
  ToyWorld world = landmark_world(11);
  std::string run = folder / "run";
};

TEST_F(Catchment, CountsAllPairsAndKeepsItsBooks) {
  const auto answer = answer_of({"catchment", run, "--json"});
  EXPECT_EQ(answer["goals"], 25);
  EXPECT_EQ(answer["places"], 25);
  EXPECT_EQ(answer["pairs"], 25 * 24);
  EXPECT_NEAR(answer["spacing_m"].get<double>(), 0.1, 1e-9);
  double pairs = 0.0;
  double weighted = 0.0;
  for (const auto& bin : answer["bins"]) {
    pairs += bin["pairs"].get<double>();
    weighted += bin["pairs"].get<double>() * bin["homeward_component"].get<double>();
  }
  EXPECT_EQ(pairs, 600.0);
  EXPECT_NEAR(weighted / pairs, answer["homeward_component"].get<double>(), 1e-6);
  EXPECT_GE(answer["homeward_component"].get<double>(), 0.8);
  double views = 0.0;
  for (const auto& view : answer["views"]) views += view["places"].get<double>();
  const auto& areas = answer["catchment_areas"];
  EXPECT_NEAR(views / 25.0, areas[1]["places"].get<double>(), 1e-9);
  for (std::size_t i = 1; i < areas.size(); ++i) {
    EXPECT_GE(areas[i]["places"].get<double>(), areas[i - 1]["places"].get<double>());
  }
  EXPECT_GE(areas[0]["places"].get<double>(), 1.0) << "who is at home stays there";
}

TEST_F(Catchment, DamagedImagesAreSkippedAndNamed) {
  const std::string damaged_file = run + "/" + view_name(7);
  std::string damaged = bytes_of(damaged_file);
  damaged[damaged.size() - 30] ^= 1;  // in the pixels
  std::ofstream(damaged_file, std::ios::binary) << damaged;
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{}, std::vector<std::string>{"--turn-randomly", "3"}}) {
    const auto result = run_panonav(with({"catchment", run, "--json"}, more));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const auto answer = json::parse(result.out);
    EXPECT_EQ(answer["goals"], 24);
    EXPECT_EQ(answer["places"], 24);
    const auto first = result.err.find("skipped: " + damaged_file);
    EXPECT_NE(first, std::string::npos) << result.err;
    EXPECT_EQ(result.err.find("skipped: ", first + 1), std::string::npos) << "once";
  }
}

TEST_F(Catchment, OneStageIsTheRuleItselfAndStagesAreRunOneAfterTheOther) {
  const auto plain = answer_of({"catchment", run, "--published", "5", "--json"});
  const auto one = answer_of({"catchment", run, "--published", "5", "--stages", "5", "--json"});
  EXPECT_EQ(plain["catchment_areas"], one["catchment_areas"]);
  const auto coarse = answer_of({"catchment", run, "--published", "1", "--json"});
  const auto two = answer_of({"catchment", run, "--published", "1", "--stages", "1,5", "--json"});
  EXPECT_EQ(coarse["homeward_component"], two["homeward_component"]);
  EXPECT_NE(coarse["catchment_areas"], two["catchment_areas"]);
}

TEST_F(Catchment, RefusesStagesThatAreNoFrequencies) {
  for (const std::string wrong : {"", "0", "2,", "a", "2,99", "2;4"}) {
    const auto result = run_panonav({"catchment", run, "--stages", wrong});
    EXPECT_EQ(result.exit_code, 2) << wrong;
    EXPECT_TRUE(contains(result.err, "--stages"));
  }
}

TEST_F(Catchment, NearPairsOnly) {
  const auto answer = answer_of({"catchment", run, "--up-to-m", "0.1", "--json"});
  EXPECT_EQ(answer["pairs"], 2 * (2 * 5 * 4));
}

TEST_F(Catchment, TurningTheRobotChangesNothingButRounding) {
  const auto straight = answer_of({"catchment", run, "--json"});
  const auto turned = answer_of({"catchment", run, "--turn-randomly", "3", "--json"});
  EXPECT_NEAR(straight["homeward_component"].get<double>(),
              turned["homeward_component"].get<double>(), 0.01);
  EXPECT_NEAR(straight["orientation_error_rad"].get<double>(),
              turned["orientation_error_rad"].get<double>(), 0.01);
  EXPECT_EQ(run_panonav({"catchment", run, "--json", "--threads", "1"}).out,
            run_panonav({"catchment", run, "--json", "--threads", "3"}).out);
}

TEST_F(Catchment, ASecondRecordingOfTheSamePlacesIsComparedWithTheFirst) {
  const auto answer = answer_of({"catchment", run, "--current", run, "--json"});
  EXPECT_EQ(answer["current"], run);
  EXPECT_EQ(answer["pairs"], 25 * 24);
}

TEST_F(Catchment, AheadPointsAlongTheWay) {
  std::vector<Pose2> poses;
  for (int i = 0; i < 30; ++i) poses.push_back({0.02 * i, 0.5, 0.0});
  const std::string way = folder / "way";
  std::filesystem::create_directory(way);
  write_dataset(way, world, poses);
  for (const std::string seed : {"", "5"}) {
    std::vector<std::string> ask{"catchment", way, "--ahead", "5", "--json"};
    if (!seed.empty()) ask.insert(ask.end(), {"--turn-randomly", seed});
    const auto answer = answer_of(ask);
    EXPECT_EQ(answer["pairs"], 25);
    EXPECT_NEAR(answer["direction_rad"].get<double>(), 0.0, radians(15.0));
    EXPECT_GE(answer["resultant_length"].get<double>(), 0.9);
  }
  expect_refusal({"catchment", way, "--ahead", "30"}, "1 to 29");
}

TEST_F(Catchment, BadInputIsOneLine) {
  expect_refusal({"catchment", run, "--up-to-m", "0"}, "> 0");
  expect_refusal({"catchment", run, "--bin-m", "-1"}, "> 0");
  expect_refusal({"catchment", run, "--goal", "none.png", "--report", folder / "r"}, "none.png");
  expect_refusal({"catchment", run, "--ahead", "2", "--goal", "x"}, "leave it out");
  expect_refusal({"catchment", run, "--max-step-m", "0"}, "max_step_m");
  std::ofstream(std::filesystem::path(run) / "poses.csv") << "file,x_m,y_m\n"
                                                          << view_name(0) << ",0,0\n";
  expect_refusal({"catchment", run}, "has no heading");
}

TEST_F(Catchment, TheReportHasItsPictures) {
  const std::filesystem::path report = folder / "report";
  run_well({"catchment", run, "--report", report});
  const std::string page = bytes_of(report / "index.html");
  (void)text_of_page(page);
  const auto panels = panels_of(page);
  ASSERT_EQ(panels.size(), 7U);
  std::size_t cells = 0;
  for (const auto& panel : panels) {
    if (!panel.data.contains("heat")) continue;
    for (const auto& value : panel.data["heat"]["values"]) {
      if (value.is_null()) continue;
      EXPECT_GE(value.get<double>(), 0.0) << panel.data["title"];
      ++cells;
    }
  }
  EXPECT_GE(cells, 3 * answer_of({"catchment", run, "--json"})["places"].get<std::size_t>());
}

TEST(RealHoming, GantryPlantsLeadHomeFromThirtyCentimetres) {
  const auto data = real_data("gantry_plants");
  PANONAV_REQUIRE_DATA(data, "gantry_plants");
  // One-bit pictures of 90 columns: higher components than usual still tell something.
  const auto answer = answer_of({"catchment", *data, "--components", "30", "--up-to-m", "0.3",
                                 "--turn-randomly", "1", "--json"});
  EXPECT_EQ(answer["pairs"], 3512);
  EXPECT_GE(answer["homeward_component"].get<double>(), 0.77);
}

TEST(RealHoming, SussexRouteLeadsAlongTheWay) {
  const auto data = real_data("sussex_route");
  PANONAV_REQUIRE_DATA(data, "sussex_route");
  const auto answer = answer_of({"catchment", *data, "--ahead", "20", "--json"});
  EXPECT_EQ(answer["pairs"], 435);
  EXPECT_NEAR(answer["direction_rad"].get<double>(), 0.0, radians(10.0));
  EXPECT_GE(answer["resultant_length"].get<double>(), 0.95);
}

}  // namespace
}  // namespace panonav::testing
