#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/pose2.hpp"
#include "support/command_runner.hpp"

namespace panonav::testing {
namespace {

using nlohmann::json;

std::map<std::string, Point2> positions(const std::filesystem::path& csv, std::size_t x_column) {
  std::map<std::string, Point2> found;
  std::ifstream file(csv);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<std::string> cells;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    found[cells.at(0)] = {std::stod(cells.at(x_column)), std::stod(cells.at(x_column + 1))};
  }
  return found;
}

void expect_plants_found(const std::vector<json>& all, const std::filesystem::path& data) {
  const auto where = positions(data / "poses.csv", 1);
  ASSERT_EQ(all.size(), 196U);
  int within = 0;
  double worst_m = 0.0;
  for (const auto& answer : all) {
    const double off_m = distance(where.at(answer["file"]), where.at(answer["matches"][0]["file"]));
    within += off_m <= 0.15 + 1e-9 ? 1 : 0;
    worst_m = std::max(worst_m, off_m);
  }
  EXPECT_GE(within, 192);
  EXPECT_LE(worst_m, 0.20 + 1e-9);
}

// Best matches within 1.5 times the distance of the nearest other view.
int found_nearest(const std::vector<json>& answers, const std::map<std::string, Point2>& where) {
  int found = 0;
  for (const auto& answer : answers) {
    const std::string file = answer["file"];
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const auto& [name, at] : where) {
      if (name != file) nearest_m = std::min(nearest_m, distance(at, where.at(file)));
    }
    const double off_m = distance(where.at(answer["matches"][0]["file"]), where.at(file));
    found += off_m <= 1.5 * nearest_m ? 1 : 0;
  }
  return found;
}

using RealData = InTemporaryFolder;

TEST_F(InTemporaryFolder, ViewsFarApartOfASimulatedFlatAreFoundByLocalFeatures) {
  const std::string run = folder / "run";
  const std::string memory = folder / "flat.panonav";
  run_well({"simulate", "loop", run, "--kind", "panorama", "--grid", "1.2"});
  const auto where = positions(folder / "run" / "poses.csv", 2);
  ASSERT_EQ(where.size(), 18U);
  const std::vector<std::string> ask{
      "localise", memory, run, "--json", "--exclude-same-file", "--turn-randomly", "3"};
  run_well({"memorise", memory, run});
  EXPECT_GE(found_nearest(answers_of(ask), where), 16);
  std::filesystem::remove(memory);
  run_well({"memorise", memory, run, "--no-features"});
  EXPECT_LE(found_nearest(answers_of(ask), where), 13);
}

// Neighbours 1.2 to 2.2 m apart: columns alone find 19 or 20.
TEST_F(RealData, PanoramasFarApartAreFoundByLocalFeatures) {
  const auto data = real_data("ciirc_b670");
  PANONAV_REQUIRE_DATA(data, "ciirc_b670");
  const auto where = positions(*data / "poses.csv", 1);
  const std::string memory = folder / "floor.panonav";
  run_well({"memorise", memory, *data});
  const json info = answer_of({"info", memory, "--json"});
  EXPECT_EQ(info["views_with_features"], 31);
  EXPECT_EQ(info["narrow_features"], false);
  EXPECT_LT(info["feature_bytes"].get<int>() / 31, 10'000);
  int found = 0;
  for (const std::string seed : {"1", "2", "3"}) {
    const auto all = answers_of(
        {"localise", memory, *data, "--json", "--exclude-same-file", "--turn-randomly", seed});
    ASSERT_EQ(all.size(), 31U);
    found += found_nearest(all, where);
  }
  EXPECT_GE(found, 84);  // measured: 28, 28, 29

  run_well({"memorise", folder / "plain.panonav", *data, "--no-features"});
  const auto plain =
      answers_of({"localise", folder / "plain.panonav", *data, "--json", "--exclude-same-file"});
  EXPECT_LE(found_nearest(plain, where), 24);
  EXPECT_FALSE(plain[0]["matches"][0].contains("verified_features"));
}

// Without dataset.toml and positions, as a user's own pictures are.
TEST_F(RealData, TheDefaultBandOfASphereFindsMoreThanTheWholeSphere) {
  const auto data = real_data("ciirc_b670");
  PANONAV_REQUIRE_DATA(data, "ciirc_b670");
  const auto where = positions(*data / "poses.csv", 1);
  const std::filesystem::path pictures = folder / "pictures";
  std::filesystem::create_directory(pictures);
  for (const auto& entry : std::filesystem::directory_iterator(*data)) {
    if (entry.path().extension() == ".jpg") std::filesystem::copy(entry.path(), pictures);
  }
  const auto count = [&](const std::string& name, const std::vector<std::string>& band) {
    const std::string memory = folder / name;
    run_well(with({"memorise", memory, pictures, "--kind", "equirectangular"}, band));
    return found_nearest(answers_of({"localise", memory, pictures, "--json", "--exclude-same-file",
                                     "--turn-randomly", "3"}),
                         where);
  };
  const int by_default = count("default", {});
  EXPECT_GE(by_default, 28);  // measured: 30
  EXPECT_EQ(count("stated", {"--elevation-deg", "-30", "40"}), by_default);
  EXPECT_LT(count("whole", {"--elevation-deg", "-90", "90"}), by_default);  // measured: 22
}

TEST_F(RealData, GantryPlantsLeaveOneOut) {
  const auto data = real_data("gantry_plants");
  PANONAV_REQUIRE_DATA(data, "gantry_plants");
  const std::string memory = folder / "plants.panonav";
  run_well({"memorise", memory, *data});
  const std::vector<std::string> ask{"localise", memory, *data, "--json", "--exclude-same-file"};
  expect_plants_found(answers_of(ask), *data);
  for (const std::string seed : {"1", "2"}) {
    auto turned = ask;
    turned.insert(turned.end(), {"--turn-randomly", seed});
    expect_plants_found(answers_of(turned), *data);
  }
}

TEST_F(RealData, SussexRouteEvenImagesRememberedOddOnesAsked) {
  const auto data = real_data("sussex_route");
  PANONAV_REQUIRE_DATA(data, "sussex_route");
  for (const std::string half : {"even", "odd"}) {
    const std::filesystem::path path = folder / half;
    std::filesystem::create_directory(path);
    std::filesystem::copy_file(*data / "dataset.toml", path / "dataset.toml");
    std::ifstream in(*data / "poses.csv");
    std::ofstream out(path / "poses.csv");
    std::string line;
    std::getline(in, line);
    out << line << '\n';
    for (int i = 0; std::getline(in, line); ++i) {
      if ((i % 2 == 0) != (half == "even")) continue;
      out << line << '\n';
      const auto name = line.substr(0, line.find(','));
      std::filesystem::create_symlink(*data / name, path / name);
    }
  }
  const std::string memory = folder / "route.panonav";
  run_well({"memorise", memory, folder / "even"});
  const auto all = answers_of({"localise", memory, folder / "odd", "--json"});
  ASSERT_EQ(all.size(), 227U);
  const auto where = positions(*data / "poses.csv", 2);
  std::vector<double> nearest_m;
  std::vector<double> interpolated_m;
  for (const auto& answer : all) {
    const Point2 truth = where.at(answer["file"]);
    nearest_m.push_back(distance(truth, where.at(answer["matches"][0]["file"])));
    if (answer["position"].is_null()) continue;
    interpolated_m.push_back(
        distance(truth, {answer["position"]["x_m"], answer["position"]["y_m"]}));
  }
  ASSERT_GE(interpolated_m.size(), 215U) << "own queries rejected: at most 5 %";
  EXPECT_LE(median(nearest_m), 0.03);
  EXPECT_LE(quantile(nearest_m, 0.95), 0.09);
  EXPECT_LT(median(interpolated_m), median(nearest_m));
  EXPECT_LE(quantile(interpolated_m, 0.95), 0.09);
}

// Images alone: a tenth of the steps are far shorter than the others, and lengths are unknown.
TEST_F(RealData, SussexRouteWithoutPositionsIsTrackedAndFollowed) {
  const auto data = real_data("sussex_route");
  PANONAV_REQUIRE_DATA(data, "sussex_route");
  const auto images = folder / "images";
  std::filesystem::create_directories(images);
  for (const auto& file : std::filesystem::directory_iterator(*data)) {
    if (file.path().extension() == ".png") {
      std::filesystem::create_symlink(std::filesystem::absolute(file.path()),
                                      images / file.path().filename());
    }
  }
  const std::string memory = folder / "images.panonav";
  run_well({"memorise", memory, images, "--kind", "panorama", "--elevation-deg", "-37.5", "37.5"});
  const auto is_localised = [](const json& answer) { return answer["state"] == "localised"; };
  EXPECT_GE(std::ranges::count_if(answers_of({"track", memory, images, "--json"}), is_localised),
            400);
  run_well({"route", "record", memory, images});
  EXPECT_GE(
      std::ranges::count_if(answers_of({"route", "follow", memory, images, "--json"}),
                            [](const json& answer) { return answer["on_route"].get<bool>(); }),
      300);
  run_well({"scale", memory, "--distance", "snapshot_100.png", "snapshot_300.png", "3.44m"});
  EXPECT_GE(std::ranges::count_if(answers_of({"track", memory, images, "--json"}), is_localised),
            400);
}

// 455 pictures over the 68 lines that they became: most lie between lines.
TEST_F(RealData, SussexRouteIsNotChangedAgainstItself) {
  const auto data = real_data("sussex_route");
  PANONAV_REQUIRE_DATA(data, "sussex_route");
  const std::string memory = folder / "route.panonav";
  run_well({"route", "record", memory, *data});
  const auto all = answers_of({"route", "follow", memory, *data, "--json"});
  ASSERT_EQ(all.size(), 455U);
  std::size_t found = 0;
  for (const auto& answer : all) {
    found += answer["on_route"].get<bool>() ? 1 : 0;
    EXPECT_TRUE(answer["changed"].empty()) << answer["file"];
  }
  // Ten images at the end of the route fit best beside their place or past the end, and are
  // refused.
  EXPECT_GE(found, 440U);
}

TEST_F(RealData, IndoorWalkTurnedFindsItselfAndItsTurn) {
  const auto data = real_data("indoor_walk_360");
  PANONAV_REQUIRE_DATA(data, "indoor_walk_360");
  const std::string memory = folder / "walk.panonav";
  run_well({"memorise", memory, *data});
  const auto all = answers_of({"localise", memory, *data, "--json", "--turn-randomly", "5"});
  ASSERT_EQ(all.size(), 117U);
  for (const auto& answer : all) {
    const auto& best = answer["matches"][0];
    EXPECT_EQ(best["file"], answer["file"]);
    EXPECT_TRUE(answer["known"].get<bool>());
    EXPECT_NEAR(angle_difference(best["heading_rad"], answer["turned_rad"]), 0.0, radians(1.0));
  }
  // Left out, it is found beside the picture before or after it more often than the 24 times that
  // columns manage: enough views are tried to tell that local features do better.
  const auto others = answers_of(
      {"localise", memory, *data, "--json", "--exclude-same-file", "--turn-randomly", "5"});
  const auto number = [&](const json& file) {
    return std::ranges::find(all, file, [](const json& one) { return one["file"]; }) - all.begin();
  };
  const auto beside = std::ranges::count_if(others, [&](const json& answer) {
    return std::abs(number(answer["matches"][0]["file"]) - number(answer["file"])) == 1;
  });
  EXPECT_GE(beside, 32);
}

}  // namespace
}  // namespace panonav::testing
