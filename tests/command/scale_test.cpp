#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "command/own_images.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Scales and routes of a map of images alone.
class ScaledMaps : public OwnImages {};

TEST_F(ScaledMaps, ACorrectedScaleMovesRoutesOfTheMapAndUndoSaysTheUnit) {
  memorise();
  run_well({"route", "record", memory(), walk(), "--name", "early"});
  const std::vector<std::string> scale{"scale", memory(), "--distance", view_name(0),
                                       view_name(25)};
  EXPECT_EQ(answer_of(with(scale, {"2m", "--json"}))["routes"], json({"early"}));
  run_well({"route", "record", memory(), walk(), "--name", "late"});
  const auto lengths = [&] {
    std::vector<double> values;
    const json info = answer_of({"info", memory(), "--json"});
    for (const json& route : info["routes"]) values.push_back(route.at("length_m"));
    return values;
  };
  const auto before = lengths();
  ASSERT_EQ(before.size(), 2U);
  run_well(with(scale, {"4m"}));
  const auto after = lengths();
  for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(after[i], 2.0 * before[i], 1e-9);
  EXPECT_EQ(answer_of({"undo", memory(), "--json"})["unit"], "m");
  const std::string undone = run_panonav({"undo", memory()}).out;
  EXPECT_TRUE(contains(undone, "positions in view steps")) << undone;
}

TEST_F(ScaledMaps, ARouteOfAnUndoneScalingIsScaledOnce) {
  memorise();
  const auto scale = [&](const char* length) {
    return answer_of(
        {"scale", memory(), "--distance", view_name(0), view_name(25), length, "--json"});
  };
  const auto length_m = [&] {
    return answer_of({"info", memory(), "--json"})["routes"][0]["length_m"].get<double>();
  };
  scale("4m");
  run_well({"route", "record", memory(), walk()});
  const double wrong_m = length_m();
  run_well({"undo", memory()});
  const auto continued = run_panonav({"route", "record", memory(), walk()});
  EXPECT_EQ(continued.exit_code, 2);
  EXPECT_TRUE(contains(continued.err, "choose another name with --name")) << continued.err;
  EXPECT_EQ(scale("2m")["routes"], json({"route"}));
  EXPECT_NEAR(length_m(), 0.5 * wrong_m, 1e-9);
  EXPECT_EQ(scale("3m")["routes"], json({"route"}));
  EXPECT_NEAR(length_m(), 0.75 * wrong_m, 1e-9);
}

TEST_F(ScaledMaps, UndoOfAScalingBeforeNewViewsSaysWhatToDo) {
  memorise();
  run_well({"scale", memory(), "--distance", view_name(0), view_name(25), "4m"});
  const std::string more = folder / "more";
  fs::create_directory(more);
  for (std::size_t i = 0; i < 8; ++i) {
    write_picture(more + "/z" + view_name(i), world,
                  {0.05 * static_cast<double>(i) - 1.5, 0.3, 0.0});
  }
  run_well({"memorise", memory(), more, "--kind", "panorama", "--elevation-deg", "-20", "20"});
  const std::string before = bytes_of(memory());
  for (const std::vector<std::string>& flag : {std::vector<std::string>{"--dry-run"}, {}}) {
    expect_refusal(with({"undo", memory()}, flag), "run panonav scale again with the right length");
    EXPECT_EQ(bytes_of(memory()), before);
  }
  run_well({"scale", memory(), "--distance", view_name(0), view_name(25), "2m"});
  EXPECT_TRUE(
      contains(run_panonav({"undo", memory(), "--dry-run"}).out, "would revert \"scale by"));
  EXPECT_EQ(answer_of({"undo", memory(), "--json"})["unit"], "m");
}

// One factor holds for one part of the map only, and its user reads so.
TEST_F(ScaledMaps, ScalingOfAMapInPartsSaysWhatItMeans) {
  memorise();
  const auto whole =
      run_panonav({"scale", memory(), "--distance", view_name(0), view_name(25), "2m"});
  EXPECT_FALSE(contains(whole.out, "not connected")) << whole.out;
  const std::string other = folder / "other";
  fs::create_directory(other);
  for (std::size_t i = 0; i < 12; ++i) {
    write_picture(other + "/z" + view_name(i), landmark_world(77),
                  {0.08 * static_cast<double>(i) - 0.5, 0.3, 0.0});
  }
  run_well({"memorise", memory(), other, "--kind", "panorama", "--elevation-deg", "-20", "20"});
  const std::vector<std::string> again{"scale",      memory(),      "--distance",
                                       view_name(0), view_name(25), "3m"};
  const auto parts = run_panonav(again);
  EXPECT_TRUE(contains(parts.out, "parts that are not connected")) << parts.out;
  EXPECT_TRUE(contains(parts.out, "may be wrong by a factor")) << parts.out;
  EXPECT_EQ(answer_of(with(again, {"--json"}))["part_sizes"], json({count, 12}));
}

// Their map has no consecutive views, and a drive along it would jump.
TEST_F(ScaledMaps, ImagesInNoOrderGetNoDriveUnnoticed) {
  const fs::path mixed = std::string(folder / "mixed");
  fs::create_directory(mixed);
  for (std::size_t i = 0; i < count; ++i) {
    fs::copy_file(walk() / view_name(i), mixed / view_name(i * 17 % count));  // a permutation
  }
  const std::string map = folder / "mixed.panonav";
  const auto stored =
      run_panonav({"memorise", map, mixed, "--kind", "panorama", "--elevation-deg", "-20", "20"});
  EXPECT_TRUE(contains(stored.out, "view steps (median distance between a view and the nearest"))
      << stored.out;
  const auto mixed_up = run_panonav({"route", "record", map, mixed});
  EXPECT_EQ(mixed_up.exit_code, 0);
  EXPECT_TRUE(contains(mixed_up.err, "shows no drive")) << mixed_up.err;
  EXPECT_TRUE(contains(mixed_up.out, "Next: panonav route follow " + map + " " + mixed.string()));
  EXPECT_FALSE(contains(mixed_up.out, "--name"));
  memorise();
  run_well({"route", "record", memory(), walk()});
  const auto second = run_panonav({"route", "record", memory(), walk(), "--name", "second"});
  EXPECT_FALSE(contains(second.err, "shows no drive")) << second.err;
  EXPECT_TRUE(contains(second.out, "Next: panonav route follow " + memory() + " " +
                                       walk().string() + " --name second"))
      << second.out;
  run_well({"route", "follow", memory(), walk(), "--name", "second"});
}

TEST_F(ScaledMaps, ScaleRefusesWhatMeansNothing) {
  memorise();
  expect_refusal({"scale", memory()}, "either --distance or --camera-height-m");
  for (const char* length : {"3.2ft", "4km", "4ccm", "4mcm", "4 m", "4", "m", "-1m", "0m", "4m m",
                             "1e9m", "nanm", "4cmm", "4M"}) {
    expect_refusal({"scale", memory(), "--distance", view_name(0), view_name(9), length},
                   "the unit m, cm or mm");
  }
  std::vector<double> factors;
  for (const char* length : {"4m", "400cm", "4e3mm"}) {
    const std::string copy = folder / (std::string(length) + ".panonav");
    fs::copy_file(memory(), copy);
    factors.push_back(answer_of(
        {"scale", copy, "--distance", view_name(0), view_name(25), length, "--json"})["factor"]);
    EXPECT_NEAR(factors.back(), factors.front(), 1e-9) << length;
  }
  expect_refusal({"scale", memory(), "--distance", view_name(0), "none.png", "1m"}, "none.png");
  expect_refusal({"scale", memory(), "--distance", view_name(0), view_name(0), "1m"}, "far apart");
  const auto unseen = run_panonav({"scale", memory(), "--camera-height-m", "0.6"});
  EXPECT_EQ(unseen.exit_code, 1) << "the images show no ground";
  EXPECT_TRUE(contains(unseen.err, "use --distance VIEW VIEW LENGTH")) << unseen.err;
  EXPECT_EQ(answer_of({"info", memory(), "--json"})["map"]["unit"], "view_steps");
  const std::string grid = folder / "grid";
  write_dataset(grid, world, grid_poses(3));
  run_well({"memorise", folder / "grid.panonav", grid});
  expect_refusal({"scale", folder / "grid.panonav", "--distance", view_name(0), view_name(1), "1m"},
                 "data set");
}

}  // namespace
}  // namespace panonav::testing
