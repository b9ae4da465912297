#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "panonav/geometry/angles.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/homing_guide.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"
#include "support/random_views.hpp"
#include "support/report_pages.hpp"

namespace panonav::testing {
namespace {

using nlohmann::json;

/// A picture of home, and others from around it with other headings.
class Home : public ::testing::Test {
 protected:
  Home() {
    std::filesystem::create_directory(folder / "run");
    write_picture(folder / "home.png", world, home);
    poses = grid_poses(3);
    for (Pose2& pose : poses) {
      pose = {0.8 + 0.4 * pose.x_m, 0.9 + 0.4 * pose.y_m, wrap_angle(7.0 * pose.x_m + pose.y_m)};
    }
    write_dataset(folder / "run", world, poses);
  }
  TemporaryFolder folder;
  ToyWorld world = landmark_world(4);
  Pose2 home{1.0, 1.0, 0.4};
  std::vector<Pose2> poses;
};

TEST_F(Home, EveryPictureOfADataSetPointsThere) {
  const auto result = run_panonav({"home", folder / "home.png", folder / "run", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto all = lines(result.out);
  ASSERT_EQ(all.size(), poses.size());
  double homeward = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto answer = json::parse(all[i]);
    EXPECT_EQ(answer["goal"], (folder / "home.png").string());
    EXPECT_EQ(answer["current"], view_name(i));
    EXPECT_NEAR(angle_difference(answer["heading_rad"], home.heading_rad - poses[i].heading_rad),
                0.0, radians(15.0));
    const double truth = std::atan2(home.y_m - poses[i].y_m, home.x_m - poses[i].x_m);
    if (answer["direction_rad"].is_null()) continue;
    EXPECT_NEAR(answer["direction_rad"].get<double>(),
                std::atan2(answer["eta"].get<double>(), answer["xi"].get<double>()), 1e-12);
    homeward += std::cos(poses[i].heading_rad + answer["direction_rad"].get<double>() - truth);
  }
  EXPECT_GE(homeward / static_cast<double>(all.size()), 0.8);
}

TEST_F(Home, WhatNeedsElevationsIsRefusedWhereTheyAreUnknown) {
  write_file(folder / "run/dataset.toml",
             std::string_view("[images]\nkind = \"panorama\"\ncolumns = \"clockwise\"\n"
                              "forward_column = 0.5\n[poses]\nfile = \"poses.csv\"\n"));
  std::vector<std::vector<std::string>> verbs{{"home", folder / "run" / view_name(0)}};
  verbs.push_back({"catchment"});
  verbs.push_back({"catchment", "--ahead", "1"});
  for (auto words : verbs) {
    words.push_back(folder / "run");
    EXPECT_NE(run_panonav(words).exit_code, 2) << words.front();
    for (const std::string option : {"--tilt", "--vertical-motion"}) {
      auto with_option = words;
      with_option.insert(with_option.end(), {option, "false"});
      const auto refused = run_panonav(with_option);
      EXPECT_EQ(refused.exit_code, 2);
      EXPECT_NE(refused.err.find(option + " has no effect"), std::string::npos) << refused.err;
    }
  }
}

TEST_F(Home, APictureOfADataSetLiesAsItSays) {
  const auto both =
      answer_of({"home", folder / "home.png", folder / ("run/" + view_name(0)), "--json"});
  const auto stated = answer_of({"home", folder / "home.png", folder / ("run/" + view_name(0)),
                                 "--kind", "panorama", "--json"});
  EXPECT_NEAR(both["heading_rad"].get<double>(), stated["heading_rad"].get<double>(), 0.02);
  const auto mirrored =
      answer_of({"home", folder / "home.png", folder / ("run/" + view_name(0)), "--kind",
                 "panorama", "--columns-run", "counter-clockwise", "--json"});
  EXPECT_NEAR(mirrored["heading_rad"].get<double>(), -both["heading_rad"].get<double>(), 0.02);
  EXPECT_NEAR(mirrored["eta"].get<double>(), -both["eta"].get<double>(), 0.01);
}

TEST_F(Home, TheLibraryGivesTheSameBits) {
  const auto memory = folder / "run.panonav";
  ASSERT_EQ(run_panonav({"memorise", memory, folder / "run"}).exit_code, 0);
  const auto run = read_dataset(folder.path() / "run");
  const HomingGuide to_view(memory, view_name(4));
  const HomingGuide to_picture(read_image(folder / "home.png"), run.source);
  std::size_t pointing = 0;
  for (const DatasetEntry& entry : run.entries) {
    const auto expect_same = [&](const json& answer, const HomingResult& way) {
      ASSERT_EQ(answer["known"].get<bool>(), way.known());
      if (!way.known()) return;
      const HomeVector& vector = way.evidence->vector;
      EXPECT_EQ(answer["xi"].get<double>(), vector.xi);
      EXPECT_EQ(answer["eta"].get<double>(), vector.eta);
      EXPECT_EQ(answer["length"].get<double>(), way.distance_r());
      EXPECT_EQ((answer["covariance"].get<std::array<double, 9>>()), vector.covariance);
      EXPECT_EQ(answer["probability"].get<double>(), way.probability());
      EXPECT_EQ(answer["direction_deviation_rad"].get<double>(),
                way.evidence->direction_deviation_rad);
      EXPECT_EQ(answer["heading_deviation_rad"].get<double>(), way.evidence->turn_deviation_rad);
      EXPECT_NEAR(angle_difference(answer["heading_rad"], -way.turn_rad()), 0.0, 1e-12);
      ASSERT_EQ(answer["direction_rad"].is_null(), !way.direction_rad);
      if (!way.direction_rad) return;
      EXPECT_EQ(answer["direction_rad"].get<double>(), *way.direction_rad);
      ++pointing;
    };
    const auto said = [&](std::vector<std::string> arguments) {
      return json::parse(lines(run_panonav(arguments).out).at(0));
    };
    const Image picture = read_image(entry.path);
    expect_same(said({"home", view_name(4), entry.path, "--memory", memory, "--json"}),
                to_view.home(picture));
    expect_same(said({"home", folder / "home.png", entry.path, "--json"}),
                to_picture.home(picture));
  }
  EXPECT_GE(pointing, 10U);
  EXPECT_FALSE(to_picture.home(read_image(folder / "home.png")).direction_rad) << "at home itself";
  EXPECT_THROW(static_cast<void>(to_view.home(Image(97, 12))), ContractError);
  EXPECT_THROW(HomingGuide(memory, "nowhere.png"), FileError);
}

TEST_F(Home, AViewOfAMemoryGivesTheSameWithinRounding) {
  const std::string memory = folder / "run.panonav";
  run_well({"memorise", memory, folder / "run"});
  const std::string goal = view_name(4);
  const auto direct = answer_of({"home", folder / ("run/" + goal), folder / "home.png", "--json"});
  const auto kept = answer_of({"home", goal, folder / "home.png", "--memory", memory, "--json"});
  EXPECT_EQ(kept["goal"], goal);
  EXPECT_NEAR(angle_difference(kept["direction_rad"], direct["direction_rad"]), 0.0, radians(3.0));
  EXPECT_NEAR(kept["length"].get<double>(), direct["length"].get<double>(), 0.01);
  EXPECT_NEAR(angle_difference(kept["heading_rad"], direct["heading_rad"]), 0.0, radians(0.5));
  const auto by_id = answer_of({"home", "5", folder / "home.png", "--memory", memory, "--json"});
  EXPECT_EQ(by_id, kept);
  // Its own image differs from the view by the rounding of the memory, which shows no direction.
  const auto at_home =
      run_panonav({"home", goal, folder / ("run/" + goal), "--memory", memory, "--json"});
  EXPECT_EQ(at_home.exit_code, 1);
  EXPECT_TRUE(json::parse(at_home.out)["direction_rad"].is_null());
}

TEST_F(Home, TheSamePictureHasNoDirection) {
  const auto result = run_panonav(
      {"home", folder / "home.png", folder / "home.png", "--kind", "panorama", "--json"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  const auto answer = json::parse(result.out);
  EXPECT_TRUE(answer["direction_rad"].is_null());
  EXPECT_NEAR(answer["correlation"].get<double>(), 1.0, 1e-4);
  const auto text =
      run_panonav({"home", folder / "home.png", folder / "home.png", "--kind", "panorama"});
  EXPECT_EQ(text.exit_code, 1);
  EXPECT_TRUE(contains(text.out, "the robot is already at home"));
}

TEST_F(Home, BetweenPicturesOfNoiseThereIsNoAnswer) {
  int known = 0;
  for (std::uint64_t pair = 0; pair < 20; ++pair) {
    for (const bool current : {false, true}) {
      Random random(pair, current ? 1 : 0);
      const Image picture = to_picture(random_panorama(random, 20, 96));
      write_png(folder / (current ? "b.png" : "a.png"), picture.view());
    }
    const auto result =
        run_panonav({"home", folder / "a.png", folder / "b.png", "--kind", "panorama", "--json"});
    const auto answer = json::parse(result.out);
    known += answer["known"].get<bool>() ? 1 : 0;
    if (answer["known"].get<bool>()) continue;
    EXPECT_EQ(result.exit_code, 1);
    for (const char* key : {"direction_rad", "length", "xi", "eta", "heading_rad", "correlation",
                            "residual", "covariance", "probability", "second"}) {
      EXPECT_TRUE(answer[key].is_null()) << key;
    }
    const auto text =
        run_panonav({"home", folder / "a.png", folder / "b.png", "--kind", "panorama"});
    EXPECT_EQ(text.exit_code, 1);
    EXPECT_TRUE(contains(text.out,
                         "no answer: the images have no more in common than those of unrelated "
                         "places"));
    EXPECT_FALSE(contains(text.out, "probability"));
    PictureSource source;
    const HomingResult way =
        HomingGuide(read_image(folder / "a.png"), source).home(read_image(folder / "b.png"));
    EXPECT_FALSE(way.known());
    EXPECT_FALSE(way.direction_rad);
    EXPECT_EQ(way.probability(), 0.0);
  }
  EXPECT_LE(known, 1) << "of 20";
}

TEST_F(Home, SaysItInWords) {
  const std::string here = folder / "here.png";
  write_picture(here, world, {0.8, 1.0, home.heading_rad - radians(90.0)});
  const auto result = run_panonav({"home", folder / "home.png", here, "--kind", "panorama"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(contains(result.out, "degrees to the left, about 0."));
  EXPECT_TRUE(contains(result.out, "the robot has rotated by "));
  EXPECT_TRUE(contains(result.out, "degrees to the right; probability"));
}

TEST_F(Home, ThePublishedRuleAndOneRowAreOtherRules) {
  const std::vector<std::string> ask{"home", folder / "home.png", folder / ("run/" + view_name(0)),
                                     "--json"};
  const auto home_with = [&](const std::vector<std::string>& more) {
    return json::parse(run_panonav(with(ask, more)).out);  // one row alone may tell nothing
  };
  const auto ours = home_with({});
  EXPECT_EQ(home_with({"--published", "5"})["frequencies"], 5.0);
  EXPECT_NE(home_with({"--horizon"})["correlation"], ours["correlation"]);
  EXPECT_NE(home_with({"--components", "8"})["xi"], ours["xi"]);
}

TEST_F(Home, BadInputIsOneLine) {
  const std::string home_file = folder / "home.png";
  const std::string run = folder / "run";
  expect_refusal({"home", home_file, home_file}, "--kind");
  expect_refusal({"home", run, home_file}, "is a folder");
  expect_refusal({"home", home_file, run, "--components", "60"}, "allowed: 3 to 48");
  expect_refusal({"home", home_file, run, "--components", "2"}, ">= 3");
  expect_refusal({"home", home_file, run, "--published", "14"}, "1 to 13");
  expect_refusal({"home", home_file, run, "--published", "5", "--weights", "equal"},
                 "--published sets 'weights'");
  expect_refusal({"home", home_file, run, "--masked-rows-top", "12"}, "leave none");
  write_picture(folder / "low.png", world, home, 96, 7);
  expect_refusal({"home", folder / "low.png", run}, "rows is 12; allowed: 7");
  std::ofstream(folder / "broken.png") << "no image";
  expect_refusal({"home", folder / "broken.png", run}, "broken.png");

  const std::string memory = folder / "run.panonav";
  run_well({"memorise", memory, run});
  expect_refusal({"home", "99", home_file, "--memory", memory}, "'99'");
  expect_refusal({"home", "1", home_file, "--memory", memory, "--rows", "7"},
                 "--rows is 7; allowed: 12, as");
  expect_refusal({"home", "1", home_file, "--memory", memory, "--components", "16"}, "3 to 15");
}

TEST_F(Home, TheReportHasItsPictures) {
  const std::filesystem::path report = folder / "report";
  run_well({"home", folder / "home.png", folder / "run", "--report", report});
  const std::string page = bytes_of(report / "index.html");
  (void)text_of_page(page);
  EXPECT_EQ(pictures_of(page), 8U);  // of four views, each below the one at home
  EXPECT_EQ(plots_of(page), std::vector<std::string>{"Home vectors from above"});
  const auto layers = panels_of(page).front().data["frames"][0]["layers"];
  EXPECT_GE(layers[0]["lines"].size(), 4U);
  run_well({"home", folder / "home.png", folder / "run", "--report", report});  // its own page
  expect_refusal({"home", folder / "home.png", folder / "run", "--report", folder / "run"},
                 "not made by panonav home");
}

}  // namespace
}  // namespace panonav::testing
