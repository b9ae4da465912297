#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/robot_navigator.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"
#include "support/recorded_messages.hpp"
#include "support/report_pages.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

using nlohmann::json;

constexpr double spacing_m = 0.5;

/// A memory of an office, arranged. Made once: rendering takes most of the time.
class Navigate : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = std::make_unique<TemporaryFolder>();
    run_well({"simulate", "office", *folder / "run", "--grid", "0.5", "--kind", "panorama",
              "--rows", "40", "--columns", "256"});
    memory = *folder / "office.panonav";
    run_well({"memorise", memory, *folder / "run"});
    bare = *folder / "bare.panonav";
    std::filesystem::copy_file(memory, bare);
    run_well({"arrange", memory});
    // Row by row of the grid.
    with_route = *folder / "with_route.panonav";
    std::filesystem::copy_file(memory, with_route);
    run_well({"route", "record", with_route, *folder / "run", "--name", "rows"});
  }
  static void TearDownTestSuite() { folder.reset(); }
  /// The view that is nearest to a place.
  static std::string view_near(Point2 place) {
    const VisualMemory views = MemoryFile::open(memory, Access::read_only).load();
    const auto nearest = std::ranges::min_element(views.views(), {}, [&](ViewId view) {
      return distance(views.info(view).pose->position(), place);
    });
    return views.info(*nearest).name;
  }
  static std::vector<std::string> there(const std::string& file,
                                        const std::vector<std::string>& more) {
    const VisualMemory views = MemoryFile::open(memory, Access::read_only).load();
    const auto& first = views.info(views.views().front());
    const auto& last = views.info(views.views().back());
    const std::string start =
        std::to_string(first.pose->x_m) + "," + std::to_string(first.pose->y_m) + ",40";
    return with({"navigate", file, "--goal", last.name, "--scene", "office", "--start", start},
                more);
  }
  static std::vector<json> objects(const std::string& out) {
    std::vector<json> result;
    for (const std::string& line : lines(out)) result.push_back(json::parse(line));
    return result;
  }

  inline static std::unique_ptr<TemporaryFolder> folder;
  inline static std::string memory;
  inline static std::string bare;
  inline static std::string with_route;
};

TEST_F(Navigate, ArrivesAndReportsEachStep) {
  const auto result = run_panonav(
      there(with_route, {"--json", "--log", *folder / "run.log", "--picture", *folder / "run.png",
                         "--route", "rows", "--report", *folder / "report"}));
  ASSERT_EQ(result.exit_code, 0) << result.err << result.out;
  const auto reported = objects(result.out);
  ASSERT_GT(reported.size(), 5U);
  int on_route = 0;
  std::size_t sure = 0;
  for (std::size_t i = 0; i + 1 < reported.size(); ++i) {
    EXPECT_EQ(reported[i]["step"], i + 1);
    EXPECT_EQ(reported[i]["state"], i + 2 < reported.size() ? "moving" : "arrived");
    EXPECT_TRUE(reported[i]["nearest"].is_string());
    EXPECT_LE(reported[i]["probability"], 1.0);
    sure += reported[i]["probability"] >= 0.9 ? 1U : 0U;
    on_route += reported[i]["on_route"].get<bool>() ? 1 : 0;
  }
  EXPECT_GT(on_route, 0);
  EXPECT_GE(sure, reported.size() * 3 / 4);
  const json& summary = reported.back();
  EXPECT_EQ(summary["end"], "arrived");
  EXPECT_EQ(summary["edges_from"], "lattice");
  EXPECT_EQ(summary["route"], "rows");
  EXPECT_EQ(summary["steps"], reported.size() - 1);
  EXPECT_LT(summary["goal_distance_m"], 0.5 * spacing_m);
  EXPECT_GT(summary["shortest_m"], 4.0 * spacing_m);
  EXPECT_GT(summary["travelled_m"], summary["shortest_m"].get<double>() - 0.5 * spacing_m);
  EXPECT_TRUE(summary["kidnapped_after_step"].is_null());

  std::ifstream log(*folder / "run.log");
  std::size_t logged = 0;
  for (std::string line; std::getline(log, line);) ++logged;
  EXPECT_EQ(logged, reported.size() - 1);
  std::ifstream picture(*folder / "run.png", std::ios::binary);
  std::string start(8, '\0');
  picture.read(start.data(), 8);
  EXPECT_EQ(start, "\x89PNG\r\n\x1a\n");
  const std::string page = bytes_of(*folder / "report/index.html");
  (void)text_of_page(page);
  const json run = panels_of(page).front().data;
  EXPECT_EQ(run["moments"].size(), reported.size() - 1);
  EXPECT_EQ(run["moments"].back()["state"], "arrived");
  EXPECT_TRUE(run["retained"].contains("goal"));
}

TEST_F(Navigate, IsLostInAnotherBuilding) {
  const std::vector<std::string> elsewhere{"navigate", memory,   "--goal", "1",
                                           "--scene",  "garden", "--seed", "2"};
  const auto result = run_panonav(with(elsewhere, {"--json"}));
  EXPECT_EQ(result.exit_code, 1) << result.err;
  const auto reported = objects(result.out);
  EXPECT_EQ(reported.back()["end"], "lost");
  EXPECT_LE(reported.size(), 25U);
  for (std::size_t i = 0; i + 1 < reported.size(); ++i) EXPECT_LT(reported[i]["probability"], 0.5);
  const auto text = run_panonav(elsewhere);
  EXPECT_NE(text.out.find("certain of its position (probability 0.5 or more) in 0 of "),
            std::string::npos)
      << text.out;
}

TEST_F(Navigate, ARecordHoldsTheGoalThePlanAndTheDirections) {
  const std::string record = *folder / "mission.mcap";
  const auto arguments = there(memory, {"--json"});
  const auto with_record = run_panonav(with(arguments, {"--record", record}));
  EXPECT_EQ(with_record.out, run_panonav(arguments).out);  // it changes nothing
  const std::size_t looks = lines(with_record.out).size() - 1;
  auto topics = topics_of(record);
  EXPECT_GE(topics.at("/plan").second, 1U);
  const std::uint64_t plans = topics.at("/plan").second;
  const std::uint64_t matches = topics.at("/best_match/compressed").second;
  expect_record(record, looks,
                {{"/best_match/compressed", {"sensor_msgs/CompressedImage", matches}},
                 {"/diagnostics", {"diagnostic_msgs/DiagnosticArray", looks}},
                 {"/directions", {"geometry_msgs/PoseArray", 1}},
                 {"/goal", {"geometry_msgs/PoseStamped", 1}},
                 {"/ground_truth", {"geometry_msgs/PoseStamped", looks}},
                 {"/plan", {"nav_msgs/Path", plans}},
                 {"/plan/points", {"sensor_msgs/PointCloud2", plans}},
                 {"/references", {"sensor_msgs/PointCloud2", 1}},
                 {"/visited", {"nav_msgs/OccupancyGrid", 1}}});
  Pose2 goal;
  for_each_message<recordings::ros::PoseStamped>(record, "/goal",
                                                 [&](const recordings::ros::PoseStamped& pose) {
                                                   goal = recordings::ros::to_pose2(pose.pose);
                                                 });
  for_each_message<recordings::ros::Path>(record, "/plan", [&](const recordings::ros::Path& way) {
    ASSERT_FALSE(way.poses.empty());
    EXPECT_NEAR(recordings::ros::to_pose2(way.poses.back().pose).x_m, goal.x_m, 1e-9);
  });
}

TEST_F(Navigate, SameSeedSameRunOnAnyNumberOfThreads) {
  const auto once = run_panonav(there(memory, {"--json", "--threads", "1"}));
  const auto again = run_panonav(there(memory, {"--json", "--threads", "2"}));
  ASSERT_FALSE(once.out.empty()) << once.err;
  EXPECT_EQ(once.out, again.out);
  EXPECT_GT(lines(once.out).size(), 5U);
}

TEST_F(Navigate, ArrangesViewsThatNothingConnects) {
  const auto result = run_panonav(there(bare, {"--json"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto reported = objects(result.out);
  EXPECT_EQ(reported.back()["edges_from"], "arrangement");
  EXPECT_LT(reported.back()["goal_distance_m"], 0.5 * spacing_m);
}

TEST_F(Navigate, NoticesThatItIsCarriedAway) {
  const VisualMemory views = MemoryFile::open(memory, Access::read_only).load();
  const auto& first = views.info(views.views().front());
  const auto result = run_panonav(there(
      memory, {"--json", "--kidnap",
               std::to_string(first.pose->x_m) + "," + std::to_string(first.pose->y_m) + ",-100"}));
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const auto reported = objects(result.out);
  EXPECT_EQ(reported.back()["end"], "arrived");
  EXPECT_LT(reported.back()["goal_distance_m"], 0.5 * spacing_m);
  ASSERT_TRUE(reported.back()["kidnapped_after_step"].is_number());
  const auto carried = reported.back()["kidnapped_after_step"].get<std::size_t>();
  ASSERT_LT(carried, reported.size() - 1);
  const Point2 back{reported[carried]["pose"]["x_m"], reported[carried]["pose"]["y_m"]};
  EXPECT_LT(distance(back, first.pose->position()), 1e-6);
  // Three steps must agree before another place is believed.
  std::optional<std::size_t> noticed;
  for (std::size_t i = carried; i + 1 < reported.size() && !noticed; ++i) {
    const Point2 here{reported[i]["pose"]["x_m"], reported[i]["pose"]["y_m"]};
    const auto believed = views.find(reported[i]["nearest"].get<std::string>());
    if (distance(views.info(*believed).pose->position(), here) < spacing_m) noticed = i;
  }
  ASSERT_TRUE(noticed.has_value());
  EXPECT_LE(*noticed, carried + 5);
}

TEST_F(Navigate, WithoutPosesItCannotSayHowFarOffItEnded) {
  const std::string nowhere = *folder / "nowhere.panonav";
  std::filesystem::copy_file(memory, nowhere);
  {
    auto file = MemoryFile::open(nowhere, Access::read_write);
    for (const ViewId view : file.views()) file.set_pose(view, std::nullopt);
  }
  const auto result = run_panonav(there(nowhere, {"--json", "--picture", *folder / "nowhere.png"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto summary = objects(result.out).back();
  EXPECT_EQ(summary["end"], "arrived");
  EXPECT_TRUE(summary["goal_distance_m"].is_null());
  EXPECT_TRUE(summary["shortest_m"].is_null());
  EXPECT_TRUE(std::filesystem::exists(*folder / "nowhere.png"));
  expect_refusal(there(nowhere, {"--kidnap", "1,1,0"}), "--kidnap");
}

TEST_F(Navigate, RefusesInOneLine) {
  const auto ask = [](const std::string& file, const std::string& goal) {
    return std::vector<std::string>{"navigate", file, "--goal", goal, "--scene", "office"};
  };
  expect_refusal(ask(memory, "no_view.png"), "no_view.png");
  expect_refusal(ask(*folder / "none.panonav", "1"), "none.panonav");
  auto wrong = ask(memory, view_near({0.0, 0.0}));
  wrong.insert(wrong.end(), {"--start", "900,900,0"});
  expect_refusal(wrong, "--start");
  wrong.back() = "1,2";
  expect_refusal(wrong, "X,Y,HEADING_DEG");
  wrong = ask(bare, view_near({0.0, 0.0}));
  wrong.insert(wrong.end(), {"--edges", "links"});
  expect_refusal(wrong, "links");

  // Routes beside which no view is known to lie, and none.
  {
    auto file = MemoryFile::open(with_route, Access::read_write);
    RoutePanorama far;
    const std::vector<float> line(360, 0.5F);
    for (const double x_m : {500.0, 501.0}) far.append({x_m, 500.0, 0.0}, line);
    ASSERT_EQ(file.append_route("far", far), 2U);
    ASSERT_EQ(file.append_route("adrift", far), 2U);
    file.set_parameter("route.adrift", "half_band_rad 0.0131 odometry");
  }
  expect_refusal(there(with_route, {"--route", "far"}), "within 0.4 m of the route 'far'");
  expect_refusal(there(with_route, {"--route", "adrift"}), "odometry");
  expect_refusal(there(with_route, {"--route", "none"}), "adrift, far, rows");

  const std::string empty = *folder / "empty.panonav";
  static_cast<void>(
      MemoryFile::create(empty, MemoryFile::open(memory, Access::read_only).header()));
  expect_refusal(ask(empty, "1"), "contains no views");
  const std::string lonely = *folder / "lonely.panonav";
  std::filesystem::copy_file(memory, lonely);
  {
    auto file = MemoryFile::open(lonely, Access::read_write);
    const ViewId view = file.views().front();
    for (const Link& link : file.links()) {
      if (link.a == view || link.b == view) file.unlink(link.a, link.b);
    }
    file.remove_map("lattice");
  }
  const VisualMemory views = MemoryFile::open(lonely, Access::read_only).load();
  const std::string name = views.info(views.views().front()).name;
  expect_refusal(ask(lonely, name), "no edge leads to the view " + name);
}

// A robot of somebody's own, in a hall that is remembered as three rows of views.
TEST(NavigateByLibrary, APictureInAndAVelocityOutWithOneAreaAtHand) {
  const TemporaryFolder folder;
  const ToyWorld world = landmark_world(4);
  constexpr std::uint32_t rows = 3;
  std::vector<Pose2> poses;
  for (int i = 0; i < 22 * static_cast<int>(rows); ++i) {
    poses.push_back({-3.5 + 0.5 * (i / 3), 1.0 + 0.5 * (i % 3), 0.0});
  }
  write_dataset(folder.path() / "run", world, poses);
  const auto memory = folder / "hall.panonav";
  ASSERT_EQ(run_panonav({"memorise", memory, folder / "run"}).exit_code, 0);
  const auto goal = view_name(poses.size() - 2);
  EXPECT_THROW(RobotNavigator(memory, goal, {.edges = RobotNavigatorOptions::GraphOrigin::links}),
               FileError)
      << "no links";
  {
    std::vector<Link> links;
    MemoryFile file = MemoryFile::open(memory, Access::read_write);
    const auto views = file.views();
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (i % rows + 1 < rows) links.push_back({views[i], views[i + 1], Link::Kind::neighbour});
      if (i + rows < views.size())
        links.push_back({views[i], views[i + rows], Link::Kind::neighbour});
    }
    file.link(links);
  }
  RobotNavigator navigator(
      memory, goal,
      {.navigator = {.views_ahead = 0}, .planner = {.areas = {.views_per_area = 12}}});
  EXPECT_EQ(navigator.origin(), RobotNavigatorOptions::GraphOrigin::links);
  EXPECT_GE(navigator.navigator().planner().areas().nodes.size(), 4U);

  Pose2 robot{-3.4, 1.4, 1.0};
  RobotNavigator::Step step;
  std::size_t max_loaded = 0;
  int decisions = 0;
  int periods = 0;
  do {
    Observation seen(world.picture(robot));
    seen.odometry = robot;
    step = navigator.step(seen);
    decisions += step.decided ? 1 : 0;
    max_loaded = std::max(max_loaded, navigator.navigator().loaded_view_count());
    robot = robot * integrate_velocity(step.velocity, BaseOptions{}.period_s);
  } while (step.decision.state == NavigationDecision::State::moving && ++periods < 5000);
  EXPECT_EQ(step.decision.state, NavigationDecision::State::arrived);
  EXPECT_EQ(step.velocity, Velocity{});
  EXPECT_LT(distance(robot.position(), poses[poses.size() - 2].position()), 0.25);
  EXPECT_GT(decisions, 30);
  EXPECT_GT(periods, 3 * decisions) << "steps go on between decisions";
  EXPECT_LT(max_loaded, 45U) << "of " << poses.size();
  EXPECT_THROW(static_cast<void>(navigator.step(Image(97, 12))), ContractError);
  EXPECT_THROW(navigator.set_goal("nowhere.png"), FileError);
}

TEST_F(Navigate, AGoalOnAnotherFloorIsRefused) {
  const std::string building = *folder / "building.panonav";
  run_well({"simulate", "lab", *folder / "upstairs", "--grid", "1", "--kind", "panorama", "--rows",
            "40", "--columns", "256"});
  run_well({"memorise", building, *folder / "run", "--floor", "ground"});
  run_well({"memorise", building, *folder / "upstairs", "--floor", "first"});
  run_well({"arrange", building});
  const auto views = answer_of({"list", building, "--json"})["views"];
  const std::string goal = views.back()["name"];
  ASSERT_EQ(views.back()["floor"], "first");
  const auto& start = views.front()["pose"];
  const auto refused =
      run_panonav({"navigate", building, "--goal", goal, "--scene", "office", "--start",
                   start["x_m"].dump() + "," + start["y_m"].dump() + ",40"});
  EXPECT_EQ(refused.exit_code, 1) << refused.err;
  EXPECT_TRUE(contains(refused.out, "unreachable after ")) << refused.out;
  EXPECT_TRUE(contains(refused.out, "the goal is on floor first, the robot on floor ground at "))
      << refused.out;
  EXPECT_FALSE(contains(refused.out, "distance from the goal's view")) << refused.out;
  const RobotNavigator robot(building, goal);
  for (const NavigationGraph::Edge& edge : robot.graph().edges()) {
    EXPECT_EQ(floor_of(robot.info(edge.a).name), floor_of(robot.info(edge.b).name));
  }
}

}  // namespace
}  // namespace panonav::testing
