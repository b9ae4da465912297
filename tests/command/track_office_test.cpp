#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/dataset.hpp"
#include "support/command_runner.hpp"
#include "support/report_pages.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::vector<std::string> with_small_pictures(std::vector<std::string> arguments) {
  return with(std::move(arguments), {"--kind", "panorama", "--rows", "20", "--columns", "128"});
}

/// A simulated office on a 25 cm grid and a walk through it, made once for all tests of this file.
class TrackOffice : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_.emplace();
    simulate({"office", *folder_ / "grid", "--grid", "0.25"});
    simulate(
        {"office", run(), "--path", "walk", "--poses", "40", "--spacing-m", "0.2", "--seed", "5"});
    run_well({"memorise", memory(), *folder_ / "grid"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  static void simulate(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "simulate");
    run_well(with_small_pictures(arguments));
  }
  static constexpr double spacing_m = 0.25;
  static std::string memory() { return *folder_ / "office.panonav"; }
  static std::string run() { return *folder_ / "walk"; }

  inline static std::optional<TemporaryFolder> folder_;
};

struct Followed {
  int exit_code = 0;
  std::vector<json> images;
};

Followed follow(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "track");
  arguments.emplace_back("--json");
  const auto result = run_panonav(arguments);
  EXPECT_EQ(result.err.empty(), result.exit_code == 0) << result.err;
  EXPECT_EQ(result.err.find("never localised") == std::string::npos, result.exit_code == 0);
  Followed followed{result.exit_code, {}};
  for (const auto& line : lines(result.out)) followed.images.push_back(json::parse(line));
  return followed;
}

double error_m(const json& image) {
  const double x = image["pose"]["x_m"].get<double>() - image["ground_truth"]["x_m"].get<double>();
  const double y = image["pose"]["y_m"].get<double>() - image["ground_truth"]["y_m"].get<double>();
  return std::hypot(x, y);
}

// A pause of 4 s and an early end of odometry cost at most a tenth of the accuracy (ATE).
TEST_F(TrackOffice, GapsInOdometryCostLittle) {
  const Dataset whole = read_dataset(run());
  const auto rms_m = [&](std::size_t begin, std::size_t end) {
    Dataset walk = whole;
    walk.folder = *folder_ / ("gap_" + std::to_string(begin) + "_" + std::to_string(end));
    fs::create_directory(walk.folder);
    for (const DatasetEntry& entry : walk.entries)
      fs::copy_file(entry.path, walk.folder / entry.file);
    for (std::size_t i = begin; i < end; ++i) walk.entries[i].odometry.reset();
    write_dataset(walk);
    const auto result = run_panonav({"track", memory(), walk.folder, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    double squares = 0.0;
    std::size_t count = 0;
    for (const auto& line : lines(result.out)) {
      const json image = json::parse(line);
      if (image["pose"].is_null()) continue;
      squares += error_m(image) * error_m(image);
      ++count;
    }
    EXPECT_EQ(count, whole.entries.size());
    return std::sqrt(squares / static_cast<double>(count));
  };
  const double expected_m = rms_m(0, 0);
  EXPECT_LT(rms_m(17, 23), 1.1 * expected_m);
  EXPECT_LT(rms_m(35, 40), 1.1 * expected_m);
}

TEST_F(TrackOffice, IsFoundSoonAndFollowedToTheEnd) {
  const auto [exit_code, images] = follow({memory(), run()});
  EXPECT_EQ(exit_code, 0);
  ASSERT_EQ(images.size(), 40U);
  const auto first =
      std::ranges::find(images, "localised", [](const json& i) { return i["state"]; });
  ASSERT_LE(first - images.begin(), 9);
  std::vector<double> errors;
  for (auto image = first; image != images.end(); ++image) {
    EXPECT_EQ((*image)["state"], "localised") << (*image)["file"];
    if ((*image)["pose"].is_null()) continue;
    errors.push_back(error_m(*image));
    EXPECT_LT(errors.back(), spacing_m) << (*image)["file"];
    EXPECT_LT(std::abs(angle_difference((*image)["pose"]["heading_rad"],
                                        (*image)["ground_truth"]["heading_rad"])),
              radians(15.0))
        << (*image)["file"];
  }
  EXPECT_LT(median(errors), 0.5 * spacing_m);
}

TEST_F(TrackOffice, OdometryCarriesItThroughAStretchWithoutPictures) {
  // Two metres between pictures.
  const auto [exit_code, images] = follow({memory(), run(), "--every", "10"});
  EXPECT_EQ(exit_code, 0);
  ASSERT_EQ(images.size(), 4U);
  for (const auto& image : images) {
    if (image["state"] != "localised") continue;
    EXPECT_LT(error_m(image), spacing_m) << image["file"];
  }
  EXPECT_EQ(images.back()["state"], "localised");
}

TEST_F(TrackOffice, AnotherRoomIsHardlyEverTakenForThisOne) {
  int images = 0;
  int localised = 0;
  int lost = 0;
  for (const char* seed : {"1", "2", "3"}) {
    const std::string room = *folder_ / ("lab" + std::string(seed));
    simulate(
        {"lab", room, "--path", "walk", "--poses", "12", "--spacing-m", "0.2", "--seed", seed});
    const auto followed = follow({memory(), room});
    int here = 0;
    for (const auto& image : followed.images) {
      ++images;
      here += image["state"] == "localised" ? 1 : 0;
      lost += image["state"] == "lost" ? 1 : 0;
    }
    EXPECT_EQ(followed.exit_code, here > 0 ? 0 : 1);
    localised += here;
  }
  EXPECT_EQ(images, 36);
  // Pictures of 20 rows tell less than the 80 of a usual memory, so one may now and then mislead.
  EXPECT_LE(localised, images / 10);
  EXPECT_GE(lost, images / 2);
}

TEST_F(TrackOffice, EvaluateReadsTheTrajectoryAndFindsTheSameErrors) {
  const std::string tum = *folder_ / "estimate.tum";
  const auto followed = follow({memory(), run(), "--tum", tum});
  std::vector<double> errors;
  for (const auto& image : followed.images) {
    if (image["state"] == "localised") errors.push_back(error_m(image));
  }
  ASSERT_GE(errors.size(), 20U);
  const auto said = answer_of({"evaluate", tum, run() + "/poses.csv", "--align", "none", "--json"});
  EXPECT_EQ(said["pairs"], errors.size());
  EXPECT_NEAR(said["ate_m"]["median"], median(errors), 1e-6);
}

TEST_F(TrackOffice, TheReportHoldsPicturesAndARunToPlay) {
  const std::string out = *folder_ / "report";
  const auto result = run_panonav({"track", memory(), run(), "--report", out});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(contains(result.out, out + "/index.html"));
  const std::string page = bytes_of(fs::path(out) / "index.html");
  (void)text_of_page(page);
  const auto panels = panels_of(page);
  ASSERT_EQ(panels.size(), 4U);
  EXPECT_EQ(panels[0].name, "run");
  const json& data = panels[0].data;
  const auto images = follow({memory(), run()}).images;
  ASSERT_EQ(data["moments"].size(), images.size());
  const auto info = answer_of({"info", memory(), "--json"});
  EXPECT_EQ(data["retained"]["references"].size(), 2 * info["views"].get<std::size_t>());
  for (std::size_t i = 0; i < images.size(); ++i) {
    const json& shown = data["moments"][i];
    EXPECT_EQ(shown["values"]["image"], images[i]["file"]);
    EXPECT_TRUE(
        shown["data"]["panorama"].get<std::string>().starts_with("data:image/jpeg;base64,"));
    EXPECT_EQ(shown["state"], images[i]["state"]);
    EXPECT_NEAR(shown["truth"][0], images[i]["ground_truth"]["x_m"], 0.001);
    EXPECT_GE(shown["particles"].size(), 3U * 100U);
    EXPECT_LE(shown["particles"].size(), 3U * 300U);
  }

  // Again into the same folder, and never into somebody else's.
  run_well({"track", memory(), run(), "--report", out});
  const fs::path foreign = *folder_ / "mine";
  fs::create_directory(foreign);
  std::ofstream(foreign / "index.html") << "mine";
  expect_refusal({"track", memory(), run(), "--report", foreign}, "not made by panonav track");
  EXPECT_EQ(bytes_of(foreign / "index.html"), "mine");
}

}  // namespace
}  // namespace panonav::testing
