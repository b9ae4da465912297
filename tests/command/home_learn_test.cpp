// Learning a home and finding it again by the command.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>

#include "command/room_run.hpp"
#include "support/command_runner.hpp"
#include "support/report_pages.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

using HomeLearnVerb = RouteVerbs;

TEST_F(HomeLearnVerb, AHomeIsLearntAndFoundAgain) {
  const std::string memory = folder_ / "m.panonav";
  const std::string walk = folder_ / "teach";
  const json area = answer_of(
      {"home", "learn", memory, walk, "--odometry", "--json", "--report", folder_ / "learnt"});
  EXPECT_EQ(area["area"], "home");
  EXPECT_GE(area["snapshots"], 1);
  EXPECT_LE(area["bytes"], 1000);
  EXPECT_EQ(plots_of(bytes_of(folder_ / "learnt/index.html")),
            (std::vector<std::string>{"Home vectors from above"}));
  run_well({"verify", memory});

  const std::vector<json> steps = answers_of(
      {"home", "home", walk, "--memory", memory, "--area", "--back-from", "21", "--json"});
  ASSERT_GE(steps.size(), 21U);
  EXPECT_EQ(steps[0]["state"], "away");
  EXPECT_TRUE(steps[0]["turn_rad"].is_null());
  EXPECT_NE(steps[20]["state"], "away");
  EXPECT_NEAR(steps[19]["distance_m"].get<double>(), 0.95, 0.2);
  EXPECT_NEAR(std::abs(steps[19]["direction_rad"].get<double>()), std::numbers::pi, 0.3);
}

TEST_F(HomeLearnVerb, WhatCannotBeUsedIsRefused) {
  const std::string memory = folder_ / "m.panonav";
  const std::string walk = folder_ / "teach";
  expect_refusal({"home", "learn", memory, walk, "--max-bytes", "100"},
                 "max_bytes is 100; allowed: >= 200");
  EXPECT_FALSE(fs::exists(memory));
  run_well({"home", "learn", memory, walk});
  expect_refusal({"home", "learn", memory, walk}, "already contains the route 'home'");
  expect_refusal({"home", "attic", walk, "--memory", memory, "--area"}, "attic");
  expect_refusal({"home", "home", walk, "--area"}, "--area needs --memory FILE");
  expect_refusal({"home", "home", walk, "--memory", memory, "--back-from", "2"},
                 "--back-from has no effect without --area");
  expect_refusal({"home", "home", walk, "--memory", memory, "--area", "--back-from", "1000"},
                 "--back-from is 1000; allowed: 1 to 81");
}

}  // namespace
}  // namespace panonav::testing
