#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "panonav/pipeline/robot_navigator.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/command_runner.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

using nlohmann::json;

// A quick exploration: small panoramas.
std::vector<std::string> explore(const std::string& memory, const std::vector<std::string>& more) {
  return with({"explore", "office", memory, "--kind", "panorama", "--rows", "40", "--columns",
               "256", "--rays-per-axis", "1", "--seed", "9101"},
              more);
}

TEST(Explore, MakesAMemoryByWhichARobotNavigates) {
  const TemporaryFolder folder;
  const std::string memory = folder / "office.panonav";
  const auto result = run_panonav(explore(memory, {"--json"}));
  ASSERT_EQ(result.exit_code, 0) << result.err << result.out;
  const auto printed = lines(result.out);
  ASSERT_GT(printed.size(), 20U);
  std::size_t memorised = 0;
  for (std::size_t i = 0; i + 1 < printed.size(); ++i) {
    const json step = json::parse(printed[i]);
    memorised += step["memorised"].get<bool>() ? 1U : 0U;
    EXPECT_NE(step["state"], "lost");
  }
  const json summary = json::parse(printed.back());
  EXPECT_EQ(summary["end"], "done");
  EXPECT_EQ(summary["views"], memorised);
  EXPECT_EQ(summary["observations"], printed.size() - 1);
  EXPECT_GE(summary["covered"], 0.9);
  EXPECT_LE(summary["explored_m"], 1.5 * summary["sweep_m"].get<double>());
  EXPECT_LE(summary["end_distance_m"], 0.1);
  const MemoryFile file = MemoryFile::open(memory, Access::read_only);
  EXPECT_EQ(file.load().size(), memorised);
  const RobotNavigator robot(memory, "view_2");
  EXPECT_EQ(robot.origin(), RobotNavigatorOptions::GraphOrigin::map);
  EXPECT_EQ(robot.graph().size(), memorised);
  const auto drive = run_panonav({"navigate", memory, "--goal", "view_2", "--scene", "office",
                                  "--seed", "9101", "--rays-per-axis", "1"});
  EXPECT_EQ(drive.exit_code, 0) << drive.err << drive.out;
}

TEST(Explore, ReportsInWordsAndStopsAtItsLimit) {
  const TemporaryFolder folder;
  const auto result =
      run_panonav(explore(folder / "a.panonav", {"--max-metres", "3", "--obstacles", "bumper"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(contains(result.out, "of the free floor"));
  EXPECT_TRUE(contains(result.out, "returning after 3"));
  EXPECT_TRUE(contains(result.out, "from the start"));
}

TEST(Explore, DoesNotReplaceAMemory) {
  const TemporaryFolder folder;
  const std::string memory = folder / "a.panonav";
  run_well(explore(memory, {"--max-metres", "2"}));
  const auto size = std::filesystem::file_size(memory);
  const auto result = run_panonav(explore(memory, {"--max-metres", "2"}));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(contains(result.err, "already exists; allowed: a new memory file")) << result.err;
  EXPECT_EQ(std::filesystem::file_size(memory), size);
}

TEST(Explore, RejectsBadOptions) {
  const TemporaryFolder folder;
  const std::string memory = folder / "a.panonav";
  for (const auto& [options, message] :
       std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"--radius-m", "0"}, "radius_m is 0; allowed: >= 0.2"},
           {{"--obstacles", "truth"}, "--obstacles"},
           {{"--odometry-drive", "holonomic"}, "--odometry-drive"},
           {{"--start", "1,1"}, "--start"},
           {{"--start", "100,1,0"}, "--start"},
           {{"--lens-seed", "2"}, "--lens-seed"}}) {
    const auto result = run_panonav(explore(memory, options));
    EXPECT_EQ(result.exit_code, 2) << message;
    EXPECT_TRUE(contains(result.err, message)) << result.err;
    EXPECT_FALSE(std::filesystem::exists(memory));
  }
}

}  // namespace
}  // namespace panonav::testing
