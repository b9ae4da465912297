#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "command_runner.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/pose2.hpp"

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

std::vector<json> answers(const std::vector<std::string>& arguments) {
  const auto result = run_panonav(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  std::vector<json> parsed;
  for (const auto& line : lines(result.out)) parsed.push_back(json::parse(line));
  return parsed;
}

#define REQUIRE_REAL_DATA(variable, folder) \
  const auto variable = real_data(folder);  \
  if (!variable) GTEST_SKIP() << "PANONAV_DATA does not name a folder that holds " folder

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

TEST(RealData, GantryPlantsLeaveOneOut) {
  REQUIRE_REAL_DATA(data, "gantry_plants");
  const TemporaryFolder folder;
  const auto memory = folder / "plants.panonav";
  ASSERT_EQ(run_panonav({"memorise", *data, memory}).exit_code, 0);
  const std::vector<std::string> ask{"localise", memory, *data, "--json", "--exclude-same-file"};
  expect_plants_found(answers(ask), *data);
  for (const std::string seed : {"1", "2"}) {
    auto turned = ask;
    turned.insert(turned.end(), {"--turn-randomly", seed});
    expect_plants_found(answers(turned), *data);
  }
}

TEST(RealData, SussexRouteEvenImagesRememberedOddOnesAsked) {
  REQUIRE_REAL_DATA(data, "sussex_route");
  const TemporaryFolder folder;
  for (const std::string half : {"even", "odd"}) {
    const auto path = folder.path() / half;
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
  const auto memory = folder / "route.panonav";
  ASSERT_EQ(run_panonav({"memorise", folder / "even", memory}).exit_code, 0);
  const auto all = answers({"localise", memory, folder / "odd", "--json"});
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

TEST(RealData, IndoorWalkTurnedFindsItselfAndItsTurn) {
  REQUIRE_REAL_DATA(data, "indoor_walk_360");
  const TemporaryFolder folder;
  const auto memory = folder / "walk.panonav";
  ASSERT_EQ(run_panonav({"memorise", *data, memory}).exit_code, 0);
  const auto all = answers({"localise", memory, *data, "--json", "--turn-randomly", "5"});
  ASSERT_EQ(all.size(), 117U);
  for (const auto& answer : all) {
    const auto& best = answer["matches"][0];
    EXPECT_EQ(best["file"], answer["file"]);
    EXPECT_TRUE(answer["known"].get<bool>());
    EXPECT_NEAR(angle_difference(best["heading_rad"], answer["turned_rad"]), 0.0, radians(1.0));
  }
}

}  // namespace
}  // namespace panonav::testing
