#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "panonav/io/trajectory_file.hpp"
#include "panonav/mapping/pose_graph.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"
#include "support/report_pages.hpp"

namespace panonav::testing {
namespace {

using nlohmann::json;

/// A memory of a grid of places.
class Arrange : public ::testing::Test {
 protected:
  Arrange() {
    std::filesystem::create_directory(folder / "run");
    poses = grid_poses(6);
    for (Pose2& pose : poses) {
      pose = {0.5 + 0.3 * pose.x_m, 0.5 + 0.3 * pose.y_m, wrap_angle(7.0 * pose.x_m + pose.y_m)};
    }
    write_dataset(folder / "run", world, poses);
    run_well({"memorise", memory, folder / "run"});
  }
  TemporaryFolder folder;
  ToyWorld world = landmark_world(4);
  std::vector<Pose2> poses;
  std::string memory = folder / "run.panonav";
};

TEST_F(Arrange, TheReportUnfolds) {
  const std::string report = folder / "report";
  run_well({"arrange", memory, "--no-save", "--report", report});
  const std::string page = bytes_of(report + "/index.html");
  (void)text_of_page(page);
  EXPECT_EQ(plots_of(page), (std::vector<std::string>{"Arrangement, step by step", "True positions",
                                                      "Computed positions"}));
  const json frames = panels_of(page).front().data["frames"];
  ASSERT_GE(frames.size(), 5U);
  const auto views = [](const json& frame) {
    std::size_t count = 0;
    for (const json& layer : frame["layers"]) {
      if (layer.contains("circles")) count += layer["circles"].size() / 2;
    }
    return count;
  };
  EXPECT_LT(views(frames.front()), views(frames.back()));
  EXPECT_EQ(frames.back()["title"], "result");
  const auto largest =
      answer_of({"arrange", memory, "--no-save", "--json"})["connected_components"][0]["views"];
  EXPECT_EQ(views(frames.back()), largest.get<std::size_t>());
  expect_refusal({"arrange", memory, "--report", folder / "run"}, "not made by panonav arrange");
}

TEST_F(Arrange, StoresAndTellsTheMap) {
  const auto answer = answer_of({"arrange", memory, "--json", "--graphml", folder / "map.graphml",
                                 "--tum", folder / "map.tum"});
  EXPECT_EQ(answer["views"], poses.size());
  ASSERT_EQ(answer["nodes"].size(), poses.size());
  EXPECT_EQ(answer["metric"], false);
  ASSERT_GE(answer["connected_components"].size(), 1U);
  EXPECT_TRUE(answer["joined_pieces"].is_array());
  EXPECT_GE(answer["candidates"], answer["springs"]);
  EXPECT_GT(answer["springs"], 0U);
  EXPECT_EQ(answer["connected_components"][0]["handedness_known"], true);
  std::size_t counted = 0;
  for (const auto& component : answer["connected_components"])
    counted += component["views"].get<std::size_t>();
  EXPECT_EQ(counted, poses.size());
  ASSERT_FALSE(answer["ground_truth"].is_null());
  EXPECT_LT(answer["ground_truth"]["procrustes_disparity"], 0.1);
  EXPECT_GT(answer["ground_truth"]["trustworthiness"], 0.8);

  const auto file = MemoryFile::open(memory, Access::read_only);
  const auto map = file.map("lattice");
  ASSERT_TRUE(map.has_value());
  EXPECT_EQ(map->nodes.size(), poses.size());
  EXPECT_EQ(map->edges.size(), answer["springs"]);
  EXPECT_GT(file.info().links, 0U);
  EXPECT_TRUE(contains(bytes_of(folder / "map.graphml"), "<graphml"));
  const TrajectoryFile written = read_trajectory_file(folder / "map.tum");
  EXPECT_EQ(written.poses.size(), answer["connected_components"][0]["views"]);
  EXPECT_FALSE(written.units.is_metric);
}

TEST_F(Arrange, LeavesTheMemoryAsItIsWhenToldSo) {
  const auto result = run_panonav({"arrange", memory, "--no-save"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(contains(result.out, "views arranged"));
  const auto file = MemoryFile::open(memory, Access::read_only);
  EXPECT_FALSE(file.map("lattice").has_value());
  EXPECT_EQ(file.info().links, 0U);
}

// Two places that have nothing in common: how many views are placed is told, and the ground truth
// is compared with these alone.
TEST_F(Arrange, TellsHowManyViewsTheLargestComponentHolds) {
  const std::size_t own = poses.size();
  const auto far = grid_poses(3);
  poses.insert(poses.end(), far.begin(), far.end());
  write_dataset(folder / "both", world, poses);
  for (std::size_t i = own; i < poses.size(); ++i) {
    write_picture(folder / "both" / view_name(i), landmark_world(77), poses[i]);
  }
  const std::string both = folder / "both.panonav";
  run_well({"memorise", both, folder / "both"});
  const auto answer = answer_of({"arrange", both, "--json"});
  const auto& components = answer["connected_components"];
  ASSERT_GE(components.size(), 2U);
  const auto largest = components[0]["views"].get<std::size_t>();
  EXPECT_LE(largest, own);
  const std::string out = run_panonav({"arrange", both}).out;
  EXPECT_TRUE(contains(out, std::to_string(components.size()) +
                                " parts that are not connected holds " + std::to_string(largest) +
                                " of the " + std::to_string(poses.size()) + " views"))
      << out;
  EXPECT_TRUE(contains(out, " over " + std::to_string(largest) + " views")) << out;
  EXPECT_TRUE(contains(out, "no path leads from one to another")) << out;
}

TEST_F(Arrange, RefusesInOneLine) {
  expect_refusal({"arrange", folder / "none.panonav"}, "none.panonav");
  expect_refusal({"arrange", memory, "--odometry", folder / "run"}, "odometry");
  expect_refusal({"arrange", memory, "--neighbours", "0"}, "neighbours");
}

}  // namespace
}  // namespace panonav::testing
