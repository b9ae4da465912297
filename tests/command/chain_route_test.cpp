// Routes as chains of snapshots: recording, listing and following by the command.

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "command/room_run.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/route/sampler_pixels.hpp"
#include "panonav/route/snapshot_chain.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_simulation/mirror.hpp"
#include "support/command_runner.hpp"
#include "support/recorded_messages.hpp"
#include "support/report_pages.hpp"
#include "support/scene_views.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

using ChainVerbs = RouteVerbs;

// A chain of snapshots takes some bytes a metre; each image of a drive along it, there or back,
// gets a motion until the drive has arrived.
TEST_F(ChainVerbs, AChainIsRecordedListedAndFollowedInBothDirections) {
  const std::string memory = folder_ / "m.panonav";
  (void)record({"--name", "lines"});
  const json chain = record({"--name", "home", "--method", "chain"});
  EXPECT_EQ(chain["method"], "chain");
  EXPECT_GE(chain["snapshots"], 2);
  EXPECT_NEAR(chain["length_m"].get<double>(), 4.0, 0.15);
  EXPECT_NEAR(chain["bytes_per_m"].get<double>(),
              chain["bytes"].get<double>() / chain["length_m"].get<double>(), 1e-6);
  const json cheap = record({"--name", "cheap", "--method", "chain", "--bytes-per-100-m", "2000"});
  EXPECT_LE(cheap["snapshots"], chain["snapshots"]);
  const json exact = record({"--name", "exact", "--method", "chain", "--distance-error", "0.01",
                             "--heading-error-rad-per-m", "0.001", "--drift", "0"});
  EXPECT_LE(exact["snapshots"], chain["snapshots"]) << "odometry is trusted farther";
  EXPECT_LT(exact["expected_offset_m"], chain["expected_offset_m"]);
  // The memory lists the reported values.
  const json routes = answer_of({"info", memory, "--json"})["routes"];
  ASSERT_EQ(routes.size(), 4U);
  EXPECT_EQ(routes[2]["name"], "home");
  EXPECT_EQ(routes[2]["bytes"], chain["bytes"]);
  EXPECT_EQ(routes[2]["spacing_m"], chain["spacing_m"]);
  EXPECT_EQ(routes[2]["expected_offset_m"], chain["expected_offset_m"]);
  EXPECT_EQ(routes[3]["method"], "panorama");
  const std::string text = run_panonav({"info", memory}).out;
  EXPECT_TRUE(contains(text, "bytes per metre")) << text;
  EXPECT_TRUE(contains(text, "expected offset")) << text;
  run_well({"verify", memory});

  write_room_run(folder_ / "there", room_, straight({-2.0, 0.0}, 0.0, 4.0, 0.1));
  write_room_run(folder_ / "back", room_, straight({2.0, 0.0}, std::numbers::pi, 4.0, 0.1));
  for (const std::string way : {"there", "back"}) {
    std::vector<std::string> words{"route",  "follow", memory,  folder_ / way,
                                   "--name", "home",   "--json"};
    if (way == "back") words.push_back("--back");
    const std::vector<json> steps = answers_of(words);
    ASSERT_GT(steps.size(), 10U) << way;
    // The images may end within the last steps of homing.
    const std::string state = steps.back()["state"];
    EXPECT_TRUE(state == "arrived" || (way == "back" && state == "homing")) << steps.back();
    EXPECT_EQ(steps.back()["snapshot"], way == "back" ? json(1) : chain["snapshots"]) << way;
    EXPECT_NEAR(steps.back()["pose"]["x_m"].get<double>(), way == "back" ? 0.0 : 4.0, 0.4) << way;
  }
}

// Returns the numbers between the braces of an array in a C header.
std::vector<int> array_of(const std::string& header, const std::string& name) {
  std::vector<int> numbers;
  const std::size_t at = header.find(" " + name + "[");
  if (at == std::string::npos) return numbers;
  const std::size_t begin = header.find('{', at) + 1;
  std::istringstream text(header.substr(begin, header.find('}', begin) - begin));
  for (int number = 0; text >> number; text.ignore(1)) numbers.push_back(number);
  return numbers;
}

TEST_F(ChainVerbs, AHeaderForFirmwareHoldsThePackedChainAndThePixelsOfTheCamera) {
  (void)record({"--name", "home", "--method", "chain"});
  const std::string memory = folder_ / "m.panonav";
  const fs::path header = folder_ / "home.h";
  const Camera camera = small_mirror_camera();
  write_camera(folder_ / "large.toml", {simulation::make_simulated_mirror_camera(), std::nullopt});
  write_camera(folder_ / "small.toml", {camera, std::nullopt});

  const json reported = answer_of(
      {"export", memory, "--firmware", header, "--camera", folder_ / "small.toml", "--json"});
  const SnapshotChain chain = MemoryFile::open(memory, Access::read_only).chain("home").value();
  const auto packed = chain.pack();
  EXPECT_EQ(reported["chain_bytes"], packed.size());
  EXPECT_EQ(array_of(bytes_of(header), "panonav_chain"),
            std::vector<int>(packed.begin(), packed.end()));
  const auto pixels =
      make_sampler_pixels(camera, chain.elevations().value(),
                          {.rows = chain.shape().rows, .components = chain.shape().components});
  EXPECT_EQ(array_of(bytes_of(header), "panonav_sampler"),
            std::vector<int>(pixels.begin(), pixels.end()));
  run_well({"export", memory, "--firmware", header});
  EXPECT_TRUE(array_of(bytes_of(header), "panonav_sampler").empty());

  expect_refusal({"export", memory, "--firmware", header, "--camera", folder_ / "large.toml"},
                 "large.toml: pixels of a picture is 307200; allowed: <= 65536");
  expect_refusal({"export", memory, "--firmware", memory}, "MEMORY");
  expect_refusal({"export", memory, "--web", folder_ / "page", "--name", "home"},
                 "--name has no effect without --firmware");
  (void)record({"--name", "lines"});
  expect_refusal({"export", memory, "--firmware", header, "--name", "lines"},
                 "route 'lines' is a route panorama; allowed here: a chain of snapshots");
}

// The trajectory, the record and the page of a run hold the same poses as its answers.
TEST_F(ChainVerbs, OutputsHoldThePosesOfTheAnswers) {
  (void)record({"--name", "home", "--method", "chain"});
  const std::string memory = folder_ / "m.panonav";
  const std::string tum = folder_ / "run.csv";
  const std::string mcap = folder_ / "run.mcap";
  const std::vector<json> steps =
      answers_of({"route", "follow", memory, folder_ / "teach", "--json", "--tum", tum, "--record",
                  mcap, "--report", folder_ / "followed"});
  ASSERT_GT(steps.size(), 10U);

  const auto trajectory = read_trajectory(tum);
  ASSERT_EQ(trajectory.size(), steps.size());
  std::vector<Pose2> recorded;
  for_each_message<recordings::ros::PoseWithCovarianceStamped>(
      mcap, "/pose", [&](const recordings::ros::PoseWithCovarianceStamped& pose) {
        recorded.push_back(recordings::ros::to_pose2(pose.pose.pose));
      });
  ASSERT_EQ(recorded.size(), steps.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double x_m = steps[i]["pose"]["x_m"];
    EXPECT_NEAR(trajectory[i].pose.x_m, x_m, 1e-9);
    EXPECT_EQ(recorded[i].x_m, x_m);
  }
  for_each_message<recordings::ros::Path>(
      mcap, "/plan", [](const recordings::ros::Path& path) { EXPECT_GE(path.poses.size(), 2U); });

  const std::string page = bytes_of(folder_ / "followed/index.html");
  EXPECT_EQ(plots_of(page), (std::vector<std::string>{"Map", "Snapshot to which the robot moves"}));
  const json run = panels_of(page).front().data;
  ASSERT_EQ(run["moments"].size(), steps.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    EXPECT_EQ(run["moments"][i]["state"], steps[i]["state"]);
  }
}

TEST_F(ChainVerbs, OptionsOfTheOtherMethodAreRefused) {
  const std::string memory = folder_ / "m.panonav";
  const std::string teach = folder_ / "teach";
  expect_refusal({"route", "record", memory, teach, "--bytes-per-100-m", "900"},
                 "--bytes-per-100-m has no effect without --method chain");
  for (const std::string option : {"--every-m", "--columns"}) {
    expect_refusal({"route", "record", memory, teach, "--method", "chain", option, "64"},
                   option + " has no effect with --method chain");
  }
  expect_refusal({"route", "record", memory, teach, "--method", "chain", "--bytes-per-100-m", "50"},
                 "50; allowed: 0, or 240 and more");
  expect_refusal({"route", "record", memory, teach, "--method", "chain", "--bytes-per-100-m", "-1"},
                 "bytes_per_100_m is -1; allowed: >= 0");
  EXPECT_FALSE(fs::exists(memory));
  (void)record({"--method", "chain"});
  expect_refusal({"route", "record", memory, teach, "--method", "chain"},
                 "already contains the route 'route'");
  expect_refusal({"route", "record", memory, teach}, "is a chain of snapshots");
  for (const std::string option : {"--no-odometry", "--levels=1"}) {
    expect_refusal({"route", "follow", memory, teach, option}, "is a chain of snapshots");
  }
  (void)record({"--name", "lines"});
  expect_refusal({"route", "follow", memory, teach, "--name", "lines", "--back"},
                 "is no chain of snapshots");
}

}  // namespace
}  // namespace panonav::testing
