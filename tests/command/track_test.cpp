#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <set>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {
namespace {

using nlohmann::json;

/// Columns that the table of a run holds besides files and odometry.
struct RunColumns {
  bool stamps = true;
  bool truth = true;
  bool odometry = true;
};

/// A circle of 0.6 m around the middle of the 5 x 5 grid.
std::vector<Pose2> circle_poses(int count) {
  std::vector<Pose2> poses;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 40.0;
    poses.push_back({1.0 + 0.6 * std::cos(angle), 1.0 + 0.6 * std::sin(angle),
                     wrap_angle(angle + 0.5 * std::numbers::pi)});
  }
  return poses;
}

/// Pictures, and a table whose odometry is the true pose seen from `odometry_from_world`.
void write_run(const std::filesystem::path& folder, const ToyWorld& world,
               const std::vector<Pose2>& poses, const Pose2& odometry_from_world = {},
               RunColumns columns = {}) {
  write_dataset(folder, world, poses);
  std::ofstream csv(folder / "poses.csv");
  csv << "file" << (columns.stamps ? ",stamp_s" : "")
      << (columns.truth ? ",x_m,y_m,heading_deg" : "")
      << (columns.odometry ? ",odom_x_m,odom_y_m,odom_heading_deg" : "") << '\n';
  const auto pose_text = [](const Pose2& pose) {
    return "," + to_text(pose.x_m) + "," + to_text(pose.y_m) + "," +
           to_text(degrees(pose.heading_rad));
  };
  for (std::size_t i = 0; i < poses.size(); ++i) {
    csv << view_name(i);
    if (columns.stamps) csv << ',' << to_text(0.5 * static_cast<double>(i));
    if (columns.truth) csv << pose_text(poses[i]);
    if (columns.odometry) csv << pose_text(odometry_from_world * poses[i]);
    csv << '\n';
  }
}

/// A memory of a 5 x 5 grid and a run through it, made once for all tests of this file.
class Track : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_.emplace();
    world_ = landmark_world(7);
    write_dataset(*folder_ / "grid", *world_, grid_poses(5));
    write_run(*folder_ / "run", *world_, circle_poses(count), {3.0, -1.0, 0.7});
    run_well({"memorise", memory(), *folder_ / "grid"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static constexpr int count = 20;
  static std::string memory() { return *folder_ / "grid.panonav"; }
  static std::string run() { return *folder_ / "run"; }

  static std::vector<json> tracked(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"track", memory()});
    arguments.push_back("--json");
    const auto result = run_panonav(arguments);
    EXPECT_LE(result.exit_code, 1) << result.err;
    std::vector<json> parsed;
    for (const auto& line : lines(result.out)) parsed.push_back(json::parse(line));
    return parsed;
  }

  inline static std::optional<TemporaryFolder> folder_;
  inline static std::optional<ToyWorld> world_;
};

TEST_F(Track, IsShownAtAddressesOfThisMachineAlone) {
  for (const std::string wrong :
       {"page", "-1", "65536", "80 ", "80:", ":80", "localhost:80", "1.2.3:80", "::1:80"}) {
    expect_refusal({"track", memory(), run(), "--view", wrong},
                   "--view is " + wrong + "; allowed: a port, 0 to 65535");
  }
  expect_refusal({"track", memory(), run(), "--view", "192.0.2.1:0"},
                 "cannot listen at 192.0.2.1, port 0");
}

TEST_F(Track, JsonLinesHaveExactlyTheDocumentedFields) {
  const auto all = tracked({run()});
  const auto truth = circle_poses(count);
  ASSERT_EQ(all.size(), truth.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const json& image = all[i];
    EXPECT_EQ(keys_of(image),
              (std::set<std::string>{"file", "stamp_s", "state", "floor", "pose", "inside",
                                     "probability", "modes", "spread_m", "particles",
                                     "effective_particles", "resampled", "injected",
                                     "difference_here", "difference_anywhere", "ground_truth"}));
    EXPECT_EQ(image["file"], view_name(i));
    EXPECT_EQ(image["stamp_s"], 0.5 * static_cast<double>(i));
    const std::string state = image["state"];
    EXPECT_TRUE(state == "localised" || state == "position_known" || state == "ambiguous" ||
                state == "lost")
        << state;
    EXPECT_EQ(image["pose"].is_null(), state == "lost");
    if (!image["pose"].is_null()) {
      EXPECT_EQ(keys_of(image["pose"]), (std::set<std::string>{"x_m", "y_m", "heading_rad"}));
    }
    EXPECT_NEAR(image["ground_truth"]["x_m"], truth[i].x_m, 1e-12);
    EXPECT_NEAR(image["ground_truth"]["heading_rad"], truth[i].heading_rad, 1e-12);
    EXPECT_GE(image["particles"].get<int>(), 1);
    EXPECT_LE(image["effective_particles"].get<double>(), image["particles"].get<double>() + 1e-6);
    EXPECT_GE(image["inside"].get<double>(), 0.0);
    EXPECT_LE(image["inside"].get<double>(), 1.0);
    EXPECT_EQ(image["inside"].get<double>() < 0.5, state == "lost");
    const double at_mode = image["modes"].empty() ? 0.0
                                                  : image["inside"].get<double>() *
                                                        image["modes"][0]["weight"].get<double>();
    EXPECT_LE(image["probability"].get<double>(), at_mode);
    EXPECT_EQ(image["probability"].get<double>() > 0.0, at_mode > 0.0);
    EXPECT_GE(image["injected"].get<int>(), 0);
    EXPECT_TRUE(image["resampled"].is_boolean());
    double weight = 0.0;
    double last = 1.0;
    for (const auto& mode : image["modes"]) {
      EXPECT_EQ(keys_of(mode),
                (std::set<std::string>{"weight", "floor", "x_m", "y_m", "heading_rad", "spread_m",
                                       "heading_spread_rad", "covariance"}));
      const double own = mode["weight"];
      EXPECT_LE(own, last);
      weight += last = own;
      ASSERT_EQ(mode["covariance"].size(), 9U);
      EXPECT_EQ(mode["covariance"][1], mode["covariance"][3]);
      const double variance =
          mode["covariance"][0].get<double>() + mode["covariance"][4].get<double>();
      EXPECT_NEAR(variance, std::pow(mode["spread_m"].get<double>(), 2), 1e-9);
    }
    EXPECT_LE(weight, 1.0 + 1e-9);
  }
}

TEST_F(Track, TheOdometryFrameDoesNotMatter) {
  write_run(*folder_ / "other_frame", *world_, circle_poses(count), {-7.0, 20.0, -2.5});
  const auto one = tracked({run()});
  const auto other = tracked({*folder_ / "other_frame"});
  ASSERT_EQ(one.size(), static_cast<std::size_t>(count));
  ASSERT_EQ(other.size(), one.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i]["state"], other[i]["state"]);
    ASSERT_FALSE(one[i]["modes"].empty());
    ASSERT_FALSE(other[i]["modes"].empty());
    EXPECT_NEAR(one[i]["modes"][0]["x_m"], other[i]["modes"][0]["x_m"], 1e-6) << i;
  }
}

TEST_F(Track, SameOutputOnAnyNumberOfThreads) {
  const auto one = run_panonav({"track", memory(), run(), "--json", "--threads", "1"});
  const auto four = run_panonav({"track", memory(), run(), "--json", "--threads", "4"});
  EXPECT_EQ(lines(one.out).size(), static_cast<std::size_t>(count));
  EXPECT_EQ(one.out, four.out);
  const auto other = run_panonav({"track", memory(), run(), "--json", "--seed", "2"});
  EXPECT_NE(one.out, other.out) << "the seed is without effect";
}

TEST_F(Track, EveryNthPictureIsLookedAtWithAllOdometryBetween) {
  const auto all = tracked({run(), "--every", "6"});
  ASSERT_EQ(all.size(), 4U);
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i]["file"], view_name(6 * i));
  // Without noise, and from the true start, odometry alone carries the particles along the circle.
  std::vector<std::string> blind{run(), "--every", "6", "--injection", "none"};
  for (const char* noise : {"translation-from-translation", "translation-from-rotation",
                            "rotation-from-translation", "rotation-from-rotation"}) {
    blind.insert(blind.end(), {std::string("--odometry-") + noise, "0"});
  }
  blind.insert(blind.end(), {"--start-x-m", "1.6", "--start-y-m", "1", "--start-heading-deg", "90",
                             "--start-deviation-m", "0", "--start-heading-deviation-deg", "0"});
  for (const auto& image : tracked(blind)) {
    ASSERT_EQ(image["modes"].size(), 1U);
    EXPECT_NEAR(image["modes"][0]["x_m"], image["ground_truth"]["x_m"], 1e-6);
    EXPECT_NEAR(image["modes"][0]["y_m"], image["ground_truth"]["y_m"], 1e-6);
    EXPECT_NEAR(
        angle_difference(image["modes"][0]["heading_rad"], image["ground_truth"]["heading_rad"]),
        0.0, 1e-6);
  }
}

TEST_F(Track, AKnownHeadingAloneLeavesThePlaceOpen) {
  // No odometry noise in the heading, no compass: all particles keep the heading they start with.
  const auto all = tracked({run(), "--start-heading-deg", "90", "--injection", "none", "--compass",
                            "false", "--odometry-rotation-from-translation", "0",
                            "--odometry-rotation-from-rotation", "0"});
  ASSERT_EQ(all.size(), static_cast<std::size_t>(count));
  for (const auto& image : all) {
    for (const auto& mode : image["modes"]) {
      EXPECT_NEAR(angle_difference(mode["heading_rad"], image["ground_truth"]["heading_rad"]), 0.0,
                  1e-6);
    }
  }
  const json& last = all.back();
  ASSERT_FALSE(last["modes"].empty());
  EXPECT_NEAR(last["modes"][0]["x_m"], last["ground_truth"]["x_m"], 0.5);
  EXPECT_NEAR(last["modes"][0]["y_m"], last["ground_truth"]["y_m"], 0.5);
}

TEST_F(Track, TextSaysTheSameAsJson) {
  const auto result = run_panonav({"track", memory(), run()});
  const auto all = tracked({run()});
  const auto said = lines(result.out);
  ASSERT_GT(said.size(), all.size()) << "no summary";
  std::size_t localised = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string state = all[i]["state"];
    EXPECT_EQ(said[i].find(view_name(i) + "  " + state), 0U) << said[i];
    localised += state == "localised" ? 1 : 0;
  }
  EXPECT_EQ(said[all.size()].find("localised at " + std::to_string(localised) + " of 20 images"),
            0U)
      << said[all.size()];
  EXPECT_EQ(result.exit_code, localised > 0 ? 0 : 1);
}

TEST_F(Track, PicturesThatShowNothingAreNoAnswer) {
  write_run(*folder_ / "dark", *world_, circle_poses(6));
  const Image black(96, 12);
  for (std::size_t i = 0; i < 6; ++i) write_png(*folder_ / "dark" / view_name(i), black.view());
  const auto result = run_panonav({"track", memory(), *folder_ / "dark"});
  EXPECT_EQ(result.exit_code, 1) << result.out;
  EXPECT_TRUE(contains(result.out, "never localised"));
}

TEST_F(Track, InAnotherPlaceItSaysWhyItIsLostAndWhatToDo) {
  write_run(*folder_ / "away", landmark_world(99), circle_poses(12));
  const auto result = run_panonav({"track", memory(), *folder_ / "away"});
  EXPECT_EQ(result.exit_code, 1) << result.out;
  EXPECT_TRUE(contains(result.err, "of 12 images fit no place of " + memory())) << result.err;
  const auto said = lines(result.out);
  const std::string next = said.back().substr(said.back().find("panonav localise"));
  std::vector<std::string> words = words_of(next);
  words.erase(words.begin());
  EXPECT_EQ(run_panonav(words).exit_code, 1) << next;
}

TEST_F(Track, ATrajectoryOfTheLocalisedImages) {
  const std::string tum = *folder_ / "estimate.tum";
  const auto all = tracked({run(), "--tum", tum});
  std::ifstream in(tum);
  ASSERT_TRUE(in);
  std::vector<double> stamps;
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("#")) stamps.push_back(std::stod(line));
  }
  std::vector<double> expected;
  for (const auto& image : all) {
    if (image["state"] == "localised") expected.push_back(image["stamp_s"]);
  }
  EXPECT_EQ(stamps, expected);
}

TEST_F(Track, WithoutStampsATrajectoryCountsPictures) {
  write_run(*folder_ / "plain", *world_, circle_poses(4), {}, {.stamps = false, .truth = false});
  const std::string tum = *folder_ / "plain.tum";
  const auto result = run_panonav({"track", memory(), *folder_ / "plain", "--tum", tum, "--json"});
  EXPECT_LE(result.exit_code, 1) << result.err;
  ASSERT_EQ(lines(result.err).size(), 1U) << result.err;
  EXPECT_TRUE(contains(result.err, "no column 'stamp_s'"));
  ASSERT_EQ(lines(result.out).size(), 4U);
  for (const auto& line : lines(result.out)) {
    EXPECT_TRUE(json::parse(line)["ground_truth"].is_null());
    EXPECT_TRUE(json::parse(line)["stamp_s"].is_null());
  }
  EXPECT_TRUE(contains(bytes_of(tum), "# stamps: image numbers\n"));
  EXPECT_FALSE(contains(bytes_of(tum), "view steps"));
}

TEST_F(Track, StampsThatDescendMakeNoTrajectory) {
  write_run(*folder_ / "back", *world_, circle_poses(3));
  const std::string table = *folder_ / "back/poses.csv";
  std::string text = bytes_of(table);
  const auto at = text.find(view_name(2) + ",1,");
  ASSERT_NE(at, std::string::npos) << text;
  std::ofstream(table) << text.replace(at + view_name(2).size() + 1, 1, "0.25");
  EXPECT_LE(run_panonav({"track", memory(), *folder_ / "back"}).exit_code, 1);
  expect_refusal({"track", memory(), *folder_ / "back", "--tum", *folder_ / "back.tum"},
                 "stamp_s of " + view_name(2) + " is 0.25");
  EXPECT_FALSE(std::filesystem::exists(*folder_ / "back.tum"));
}

TEST_F(Track, PositionsThatCannotBeMetresAreRefused) {
  auto far = circle_poses(3);
  far[1].x_m = 1e300;
  write_run(*folder_ / "far", *world_, far);
  const auto line = refusal({"track", memory(), *folder_ / "far"});
  EXPECT_TRUE(contains(line, "line 3: x_m is 1e+300; allowed: -10000000 to 10000000 m"));
  std::vector<std::string> start{"track", memory(),      run(), "--start-x-m",
                                 "1e12",  "--start-y-m", "0",   "--start-heading-deg",
                                 "0"};
  expect_refusal(start, "--start-x-m");
  // Far, but possible: no answer and no crash.
  start[4] = "9e6";
  EXPECT_LE(run_panonav(start).exit_code, 1);
}

TEST_F(Track, AMemoryWithTooFewPositionsIsRefusedByName) {
  const std::string small = *folder_ / "small.panonav";
  write_dataset(*folder_ / "few", *world_, grid_poses(2));
  run_well({"memorise", small, *folder_ / "few"});
  expect_refusal({"track", small, run()},
                 "small.panonav: holds 4 views with a position; allowed: 8");
  const std::string heap = *folder_ / "heap.panonav";
  write_dataset(*folder_ / "one_place", *world_, std::vector<Pose2>(9, Pose2{1.0, 1.0, 0.0}));
  run_well({"memorise", heap, *folder_ / "one_place"});
  expect_refusal({"track", heap, run()}, "heap.panonav");
}

TEST_F(Track, WrongValuesAreNamedWithTheirRange) {
  const auto refused = [](std::vector<std::string> more) {
    more.insert(more.begin(), {"track", memory(), run()});
    return refusal(more);
  };
  EXPECT_TRUE(contains(refused({"--every", "0"}), "--every is '0'"));
  EXPECT_TRUE(contains(refused({"--start-x-m", "1"}), "need --start-heading-deg"));
  EXPECT_TRUE(contains(refused({"--start-x-m", "1", "--start-y-m", "1"}), "--start-heading-deg"));
  EXPECT_TRUE(
      contains(refused({"--start-heading-deg", "north"}), "--start-heading-deg is 'north'"));
  EXPECT_TRUE(contains(refused({"--start-deviation-m", "-1"}), "deviation_m is -1"));
  EXPECT_TRUE(contains(refused({"--start-deviation-m", "1"}), "need --start-x-m"));
  EXPECT_TRUE(contains(refused({"--injection", "sometimes"}), "injection"));
  EXPECT_TRUE(contains(refused({"--kld-error", "2"}), "kld_error is 2"));
  EXPECT_TRUE(contains(refused({"--min-particles", "300", "--max-particles", "200"}),
                       "--min-particles is 300; allowed: at most"));
  expect_refusal({"track", memory(), *folder_ / "nowhere"}, "nowhere");
  expect_refusal({"track", *folder_ / "no.panonav", run()}, "no.panonav");
  EXPECT_TRUE(contains(refused({"--tum", *folder_ / "nowhere/estimate.tum"}), "estimate.tum"));
}

TEST_F(Track, WithoutOdometryMotionIsReadFromThePicturesAndItSaysSo) {
  const auto folder = *folder_ / "no_odometry";
  write_run(folder, *world_, circle_poses(count), {}, {.odometry = false});
  const auto result = run_panonav({"track", memory(), folder});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(contains(result.err,
                       "has no odometry (columns odom_x_m,odom_y_m,odom_heading_deg); "
                       "motion is computed from the images"));
  EXPECT_TRUE(contains(result.err, "motion: the images show 19 of 19 steps")) << result.err;
  std::vector<double> errors;
  for (const json& image : tracked({folder})) {
    if (image["state"] != "localised") continue;
    errors.push_back(std::hypot(
        image["pose"]["x_m"].get<double>() - image["ground_truth"]["x_m"].get<double>(),
        image["pose"]["y_m"].get<double>() - image["ground_truth"]["y_m"].get<double>()));
  }
  ASSERT_GE(errors.size(), count / 2U);
  std::ranges::sort(errors);
  EXPECT_LE(errors[errors.size() / 2], 0.3);

  // A folder of pictures alone does, too: they lie as the memory's own.
  for (const char* table : {"dataset.toml", "poses.csv"}) std::filesystem::remove(folder / table);
  const auto bare = run_panonav({"track", memory(), folder});
  EXPECT_EQ(bare.exit_code, 0) << bare.err;
  EXPECT_TRUE(contains(bare.err, "motion is computed from the images"));
}

// Views nearer to each other than an image tells apart are one place.
TEST_F(Track, AMemoryOfDenseViewsDoesNotMakeThePlaceAmbiguous) {
  const auto folder = *folder_ / "dense";
  std::vector<Pose2> poses;
  for (int i = 0; i < 160; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 320.0;  // 1.2 cm apart
    poses.push_back({1.0 + 0.6 * std::cos(angle), 1.0 + 0.6 * std::sin(angle),
                     wrap_angle(angle + 0.5 * std::numbers::pi)});
  }
  write_run(folder, *world_, poses, {}, {.odometry = false});
  const std::string dense = *folder_ / "dense.panonav";
  run_well({"memorise", dense, folder});
  std::size_t localised = 0;
  for (const json& image : answers_of({"track", dense, folder, "--json"})) {
    localised += image["state"] == "localised" ? 1 : 0;
  }
  EXPECT_GE(localised, 150U);
}

// The poses of a run are in another frame than a map of its images, also in metres.
TEST_F(Track, PositionsOfAMapAreNotComparedWithThoseOfTheRun) {
  const std::string drive = *folder_ / "drive";
  write_run(drive, *world_, circle_poses(count), {3.0, -1.0, 0.7}, {.truth = false});
  const std::string map = *folder_ / "map.panonav";
  run_well({"map", map, drive});
  EXPECT_FALSE(contains(run_panonav({"info", map}).out, "view steps"));
  const auto expect_no_truth = [&](const std::vector<std::string>& arguments) {
    SCOPED_TRACE(arguments.front() + " " + arguments.back());
    const auto text = run_panonav(arguments);
    EXPECT_EQ(text.exit_code, 0) << text.err;
    EXPECT_TRUE(contains(text.err, "are of its map and have another frame")) << text.err;
    EXPECT_FALSE(contains(text.out, "error of")) << text.out;
    const auto answers = answers_of(with(arguments, {"--json"}));
    EXPECT_EQ(answers.size(), static_cast<std::size_t>(count));
    for (const json& answer : answers) EXPECT_TRUE(answer.value("ground_truth", json()).is_null());
  };
  const std::string page = *folder_ / "page";
  expect_no_truth({"track", map, run(), "--report", page});
  EXPECT_FALSE(contains(bytes_of(page + "/index.html"), "The ring is the true position"));
  const std::string answers = *folder_ / "answers";
  expect_no_truth({"localise", map, run(), "--report", answers});
  EXPECT_FALSE(contains(bytes_of(answers + "/index.html"), "\"truth\":{"));
  expect_no_truth({"localise", map, run(), "--update"});
  // Positions of a data set are those of the run, and are compared.
  EXPECT_TRUE(contains(run_panonav({"track", memory(), run()}).out, "error of"));
}

}  // namespace
}  // namespace panonav::testing
