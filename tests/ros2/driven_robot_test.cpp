#include <cmath>
#include <map>
#include <numbers>

#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/navigation/floor_scanner.hpp"
#include "panonav/pipeline/homing_guide.hpp"
#include "panonav/route/chain_recorder.hpp"
#include "panonav_ros2/simulated_robot.hpp"
#include "ros2/node_on_the_wire.hpp"

namespace panonav::ros2 {
namespace {

/// In the first of the two rooms, faster than life.
class DrivenRobot {
 public:
  explicit DrivenRobot(const testing::ToyWorld& world,
                       std::function<Image(const Pose2& pose)> picture, double time_factor)
      : robot_({.node = "robot"}, {.time_factor = time_factor},
               {{0.8, 0.8, 0.3},
                [&world](Point2 place) { return testing::robot_fits(world, place); },
                [picture](const Pose2& pose, std::uint64_t) { return picture(pose); },
                [&world](const Pose2& pose, std::uint64_t) { return measure_ranges(world, pose); }},
               {}, 1, [](const std::string& line) { ADD_FAILURE() << line; }),
        thread_([this] { robot_.run(); }) {}
  ~DrivenRobot() {
    robot_.stop();
    thread_.join();
  }

 private:
  static std::vector<double> measure_ranges(const testing::ToyWorld& world, const Pose2& pose) {
    std::vector<double> ranges_m(16, 0.0);
    for (std::size_t i = 0; i < ranges_m.size(); ++i) {
      const double direction_rad = static_cast<double>(i) * std::numbers::pi / 8.0;
      const Point2 unit{std::cos(direction_rad), std::sin(direction_rad)};
      double& range_m = ranges_m[i];
      while (range_m < 3.0 &&
             world.clearance_m(pose * Point2{range_m * unit.x_m, range_m * unit.y_m}) > 0.02) {
        range_m += 0.02;
      }
    }
    return ranges_m;
  }

  SimulatedRobot robot_;
  std::thread thread_;
};

TEST_F(LocalisationNodeOnTheWire, DrivesASimulatedRobotToAGoalFindsItKidnappedAndStopsIt) {
  start({.use_sim_time = true});
  auto& goal = peer_.talk<recordings::ros::PoseStamped>("goal_pose");
  auto& set_pose = peer_.talk<recordings::ros::PoseStamped>("set_pose");
  auto& result = peer_.listen<recordings::ros::DiagnosticArray>("panonav/goal/result");
  auto& feedback = peer_.listen<recordings::ros::DiagnosticArray>("panonav/goal/feedback");
  auto& velocity = peer_.listen<recordings::ros::Twist>("cmd_vel");
  auto& truth = peer_.listen<recordings::ros::PoseStamped>("ground_truth", false);
  auto& pose = peer_.listen<recordings::ros::PoseWithCovarianceStamped>("panonav/pose");
  std::optional<DrivenRobot> robot;
  robot.emplace(world_, picture, 6.0);
  ASSERT_TRUE(peer_.all_matched(10s));
  const auto robot_is = [&] { return newest_pose(truth); };
  const auto state_of = [](const FastPeer::Bytes& cdr) {
    return cdr.empty() ? std::string("nothing")
                       : read<recordings::ros::DiagnosticArray>(cdr).status.at(0).message;
  };
  ASSERT_TRUE(comes_true([&] { return node_->counts().localised >= 3; }));

  // Who writes before both sides know of each other may not be heard: a goal in another frame,
  // which is refused, tells that the node hears.
  ASSERT_TRUE(comes_true([&] {
    FastPeer::write(goal, recordings::ros::PoseStamped{{0, "moon"}, {}});
    return notes_with("moon") > 0;
  }));
  const auto send_to = [&](Point2 place) {
    FastPeer::write(goal, recordings::ros::PoseStamped{
                              {0, "map"}, recordings::ros::to_pose({place.x_m, place.y_m, 0.0})});
    return state_of(FastPeer::next(feedback, 90s));  // after the arrangement of all views
  };
  const Point2 there{2.8, 2.8};
  EXPECT_EQ(send_to(there), "moving");
  EXPECT_EQ(state_of(FastPeer::next(result, 60s)), "arrived");
  EXPECT_LT(distance(robot_is().position(), there), 0.3);

  Point2 elsewhere{5.2, 2.0};
  while (world_.clearance_m(elsewhere) < 0.5) elsewhere.x_m += 0.1;
  // Carried to the other room, it is found there, and sent back it comes.
  const std::size_t before = node_->counts().pictures;
  while (FastPeer::waiting(pose) > 0) (void)FastPeer::next(pose, 1s);
  FastPeer::write(set_pose,
                  recordings::ros::PoseStamped{
                      {0, "map"}, recordings::ros::to_pose({elsewhere.x_m, elsewhere.y_m, 2.0})});
  EXPECT_TRUE(comes_true([&] {
    const auto cdr = FastPeer::next(pose, 1s);
    return !cdr.empty() && node_->counts().pictures > before &&
           distance(recordings::ros::to_pose2(
                        read<recordings::ros::PoseWithCovarianceStamped>(cdr).pose.pose)
                        .position(),
                    elsewhere) < 0.3;
  }));

  // Its pictures end in the middle of the way: so does its motion.
  while (FastPeer::waiting(velocity) > 0) (void)FastPeer::next(velocity, 1s);
  while (FastPeer::waiting(feedback) > 0) (void)FastPeer::next(feedback, 1s);
  EXPECT_EQ(send_to({elsewhere.x_m + 1.5, elsewhere.y_m}), "moving");
  bool moved = false;
  for (int i = 0; i < 200 && !moved; ++i) {
    const auto cdr = FastPeer::next(velocity, 5s);
    ASSERT_FALSE(cdr.empty()) << state_of(FastPeer::next(result, 100ms));
    const auto twist = read<recordings::ros::Twist>(cdr);
    moved = twist.linear.x != 0.0 || twist.angular.z != 0.0;
  }
  EXPECT_TRUE(moved);
  robot.reset();
  bool stands = false;
  for (int i = 0; i < 200 && !stands; ++i) {
    const auto cdr = FastPeer::next(velocity, 5s);
    ASSERT_FALSE(cdr.empty());
    const auto twist = read<recordings::ros::Twist>(cdr);
    stands = twist.linear.x == 0.0 && twist.angular.z == 0.0;
  }
  EXPECT_TRUE(stands);
  EXPECT_TRUE(comes_true([&] { return notes_with("the robot is stopped") == 1; }));
  stop();
  EXPECT_EQ(state_of(FastPeer::next(result, 5s)), "the node ends");
}

TEST_F(LocalisationNodeOnTheWire, PublishesTheFloorAroundASimulatedRobotAsAScan) {
  constexpr ElevationBand down_to_the_floor{-1.0, 0.3};
  DrivenRobot robot(
      world_,
      [&](const Pose2& pose) {
        return to_picture(world_.panorama(pose, 80, 256, down_to_the_floor));
      },
      2.0);
  LocalisationNodeSetup setup{
      .memory = *folder_ / "floor.panonav",
      .node = {.use_sim_time = true, .camera_height_m = testing::ToyWorld::camera_height_m}};
  PictureSource pictures{.kind = PictureKind::panorama};
  pictures.layout.elevations = down_to_the_floor;
  setup.teacher = TeacherOptions{
      .pictures = pictures, .route = std::nullopt, .signature = {}, .preprocessing = {}};
  start(setup);
  auto& velocity = peer_.talk<recordings::ros::Twist>("cmd_vel");
  auto& truth = peer_.listen<recordings::ros::PoseStamped>("ground_truth", false);
  auto& scans = peer_.listen<recordings::ros::LaserScan>("panonav/floor_scan");
  ASSERT_TRUE(peer_.all_matched(10s));
  ASSERT_TRUE(comes_true([&] { return node_->counts().pictures >= 2; }));
  for (int i = 0; i < 60; ++i) {
    FastPeer::write(velocity, recordings::ros::Twist{{0.2, 0.0, 0.0}, {}});
    std::this_thread::sleep_for(40ms);
  }
  FastPeer::write(velocity, recordings::ros::Twist{});
  std::map<std::int64_t, Pose2> poses;
  while (FastPeer::waiting(truth) > 0) {
    const auto each = read<recordings::ros::PoseStamped>(FastPeer::next(truth, 1s));
    poses[each.header.stamp_ns] = recordings::ros::to_pose2(each.pose);
  }
  recordings::ros::LaserScan scan;
  while (FastPeer::waiting(scans) > 0) {
    scan = read<recordings::ros::LaserScan>(FastPeer::next(scans, 1s));
    if (scan.header.stamp_ns >= poses.rbegin()->first - 500'000'000) break;
  }
  EXPECT_EQ(scan.header.frame_id, "camera");
  ASSERT_EQ(poses.count(scan.header.stamp_ns), 1U);
  ASSERT_EQ(scan.ranges.size(), std::size_t{FloorScanner::sectors});
  EXPECT_NEAR(scan.angle_max, scan.angle_min + 63 * scan.angle_increment, 1e-4);
  const Pose2 robot_is = poses[scan.header.stamp_ns];
  int obstacles = 0;
  int near = 0;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    if (!std::isfinite(scan.ranges[i])) continue;
    EXPECT_GE(scan.ranges[i], scan.range_min);
    EXPECT_LT(scan.ranges[i], scan.range_max);
    const double azimuth_rad = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    const Point2 end = robot_is * Point2{scan.ranges[i] * std::cos(azimuth_rad),
                                         scan.ranges[i] * std::sin(azimuth_rad)};
    ++obstacles;
    near += world_.clearance_m(end) < 0.2 ? 1 : 0;
  }
  EXPECT_GE(obstacles, 5);
  EXPECT_GE(near, 0.6 * obstacles);
}

TEST_F(LocalisationNodeOnTheWire, LearnsADriveRepeatsItAndGoesOnAfterItDied) {
  const fs::path drive = *folder_ / "drive.panonav";
  const fs::path mission = drive.string() + ".mission";
  constexpr double time_factor = 4.0;
  DrivenRobot robot(world_, picture, time_factor);
  LocalisationNodeSetup setup{.memory = drive, .node = {.use_sim_time = true}};
  setup.teacher =
      TeacherOptions{.pictures = source(), .route = "drive", .signature = {}, .preprocessing = {}};
  start(setup);
  auto& velocity = peer_.talk<recordings::ros::Twist>("cmd_vel");
  auto& set_pose = peer_.talk<recordings::ros::PoseStamped>("set_pose");
  auto& contact = peer_.talk<recordings::ros::PointStamped>("contact");
  auto& truth = peer_.listen<recordings::ros::PoseStamped>("ground_truth", false);
  auto& result = peer_.listen<recordings::ros::DiagnosticArray>("panonav/goal/result");
  ASSERT_TRUE(peer_.all_matched(10s));
  const auto robot_is = [&] { return newest_pose(truth); };
  ASSERT_TRUE(comes_true([&] { return node_->counts().pictures >= 3; }));
  EXPECT_EQ(ask("repeat drive").find("refused: "), 0U);
  for (int i = 0; i < 70; ++i) {  // a bend of 2.3 m
    FastPeer::write(velocity,
                    recordings::ros::Twist{{0.3, 0.0, 0.0}, {0.0, 0.0, i < 35 ? -0.05 : 0.3}});
    std::this_thread::sleep_for(28ms);
  }
  FastPeer::write(velocity, recordings::ros::Twist{});
  std::this_thread::sleep_for(200ms);
  const Pose2 end = robot_is();
  EXPECT_GT(end.x_m, 2.0);
  EXPECT_EQ(ask("finish"), "finish done");
  EXPECT_GE(node_->counts().taught, 8U);

  // A little ahead of the beginning: right there, a robot may also be before the route.
  const auto carried_back = [&] {
    FastPeer::write(set_pose, recordings::ros::PoseStamped{
                                  {0, "map"}, recordings::ros::to_pose({1.1, 0.9, 0.2})});
    std::this_thread::sleep_for(100ms);
  };
  const auto arrives = [&] {
    const auto cdr = FastPeer::next(result, 30s);
    EXPECT_FALSE(cdr.empty()) << (notes_.empty() ? "" : notes_.back());
    if (cdr.empty()) return false;
    EXPECT_EQ(read<recordings::ros::DiagnosticArray>(cdr).status.at(0).message, "arrived");
    EXPECT_LT(distance(robot_is().position(), end.position()), 0.25);
    return true;
  };
  carried_back();
  EXPECT_EQ(ask("repeat drive"), "repeat done");
  EXPECT_TRUE(arrives());
  EXPECT_FALSE(fs::exists(mission));

  // One that touches something stops there.
  carried_back();
  EXPECT_EQ(ask("repeat drive"), "repeat done");
  ASSERT_TRUE(comes_true([&] { return robot_is().x_m > 1.3; }));
  FastPeer::write(contact, recordings::ros::PointStamped{{0, "base_link"}, {0.2, 0.0, 0.0}});
  const auto obstructed = FastPeer::next(result, 10s);
  ASSERT_FALSE(obstructed.empty());
  EXPECT_EQ(read<recordings::ros::DiagnosticArray>(obstructed).status.at(0).message,
            "an obstacle is on the route");
  EXPECT_LT(robot_is().x_m, 2.0);

  // A chain of snapshots leads back to where it began; a route panorama does not.
  EXPECT_EQ(ask("return drive").find("refused: "), 0U);
  (void)FastPeer::next(result, 5s);  // the refusal
  const HomingEncoder encoder(MemoryFile::open(drive, Access::read_only).header(), source());
  ChainRecorder recorder;
  const Pose2 beginning{0.8, 0.8, 0.2};
  for (int i = 0; i <= 20; ++i) {
    const Pose2 moved{i == 0 ? 0.0 : 0.1, 0.0, 0.0};
    recorder.add(
        encoder.view(encoder.panorama(Observation(picture(beginning * Pose2{0.1 * i, 0.0, 0.0})))),
        moved);
  }
  MemoryFile::open(drive, Access::read_write).save_chain("chain", recorder.finish());
  FastPeer::write(set_pose,
                  recordings::ros::PoseStamped{
                      {0, "map"}, recordings::ros::to_pose(beginning * Pose2{2.0, 0.0, 1.0})});
  std::this_thread::sleep_for(100ms);
  EXPECT_EQ(ask("return chain"), "return done");
  const auto ending = FastPeer::next(result, 30s);
  ASSERT_FALSE(ending.empty());
  EXPECT_EQ(read<recordings::ros::DiagnosticArray>(ending).status.at(0).message, "arrived");
  EXPECT_LT(distance(robot_is().position(), beginning.position()), 0.25);

  // The mission of a node that was killed is continued by the next one.
  carried_back();
  EXPECT_EQ(ask("repeat drive"), "repeat done");
  ASSERT_TRUE(comes_true([&] { return fs::exists(mission) && robot_is().x_m > 1.3; }));
  const auto left = read_file(mission, 1000);
  stop();
  EXPECT_FALSE(fs::exists(mission));
  EXPECT_EQ(read<recordings::ros::DiagnosticArray>(FastPeer::next(result, 5s)).status.at(0).message,
            "the node ends");
  write_file(mission, left);
  setup.teacher.reset();
  start(setup);
  EXPECT_TRUE(arrives());
  stop();

  // One of a node that died long ago, or half of one, sends no robot anywhere.
  write_file(mission, left);
  fs::last_write_time(mission, fs::file_time_type::clock::now() - 60s);
  start(setup);
  EXPECT_EQ(notes_with("the robot does not continue"), 1U);
  EXPECT_FALSE(fs::exists(mission));
  stop();
  write_file(mission, std::string_view("1 2 3 repeat"));
  start(setup);
  EXPECT_EQ(notes_with("is damaged"), 1U);
}

TEST_F(LocalisationNodeOnTheWire, ExploresAndIsLocalisedInWhatItMadeOrStopsWhereItIsToldTo) {
  std::optional<DrivenRobot> robot;
  robot.emplace(world_, picture, 6.0);
  LocalisationNodeSetup setup{
      .memory = *folder_ / "explored.panonav",
      .node = {.use_sim_time = true, .camera_height_m = testing::ToyWorld::camera_height_m}};
  setup.navigator.base.speed_m_s = 0.5;
  setup.exploration = ExplorationSetup{source(), {.radius_m = 0.4, .max_metres = 6.0}, {}, {}};
  start(setup);
  auto& feedback = peer_.listen<recordings::ros::DiagnosticArray>("panonav/goal/feedback");
  auto& result = peer_.listen<recordings::ros::DiagnosticArray>("panonav/goal/result");
  auto& truth = peer_.listen<recordings::ros::PoseStamped>("ground_truth", false);
  auto& velocity = peer_.listen<recordings::ros::Twist>("cmd_vel");
  auto& pose = peer_.listen<recordings::ros::PoseWithCovarianceStamped>("panonav/pose");
  ASSERT_TRUE(peer_.all_matched(10s));
  ASSERT_TRUE(comes_true([&] { return node_->counts().pictures >= 3; }));
  const auto value_of = [](const FastPeer::Bytes& cdr, const std::string& key) {
    if (cdr.empty()) return std::string("nothing");
    const auto status = read<recordings::ros::DiagnosticArray>(cdr).status.at(0);
    for (const auto& each : status.values) {
      if (each.key == key) return each.value;
    }
    return status.message;
  };
  const Pose2 beginning = newest_pose(truth);
  EXPECT_EQ(FastPeer::waiting(velocity), 0U);  // it stands until the command
  EXPECT_EQ(ask("relocalise").find("refused: "), 0U);
  EXPECT_EQ(ask("explore"), "explore done");
  EXPECT_EQ(ask("explore").find("refused: "), 0U);
  (void)FastPeer::next(result, 5s);  // the refusal
  const auto first = FastPeer::next(feedback, 10s);
  EXPECT_EQ(value_of(first, "state"), "exploring");
  EXPECT_EQ(value_of(first, "views"), "1");
  const auto ended = FastPeer::next(result, 60s);
  EXPECT_EQ(value_of(ended, "state"), "done: the largest distance (max_metres) is driven");
  const int views = std::atoi(value_of(ended, "views").c_str());
  EXPECT_GE(views, ObservationModel::min_views);  // so that it is localised
  EXPECT_GT(std::atof(value_of(ended, "covered").c_str()), 0.1);
  EXPECT_LT(distance(newest_pose(truth).position(), beginning.position()), 0.3);
  EXPECT_EQ(node_->counts().taught, static_cast<std::size_t>(views));
  const Pose2 seen = recordings::ros::to_pose2(
      read<recordings::ros::PoseWithCovarianceStamped>(FastPeer::next(pose, 20s)).pose.pose);
  EXPECT_LT(std::hypot(seen.x_m, seen.y_m), 0.4);  // the map's origin is the first view
  EXPECT_EQ(MemoryFile::open(setup.memory, Access::read_only).load().views().size(),
            static_cast<std::size_t>(views));
  EXPECT_EQ(ask("explore").find("refused: "), 0U);  // its memory is made
  stop();

  setup.memory = *folder_ / "cancelled.panonav";
  start(setup);
  ASSERT_TRUE(peer_.all_matched(10s));
  ASSERT_TRUE(comes_true([&] { return node_->counts().pictures >= 3; }));
  EXPECT_EQ(ask("explore"), "explore done");
  ASSERT_TRUE(comes_true([&] { return node_->counts().taught >= 2; }));
  (void)ask("cancel");
  EXPECT_EQ(value_of(FastPeer::next(result, 20s), "state"), "cancelled");
  EXPECT_GE(MemoryFile::open(setup.memory, Access::read_only).load().views().size(), 2U);
  std::this_thread::sleep_for(200ms);
  const Pose2 stopped = newest_pose(truth);
  std::this_thread::sleep_for(200ms);
  EXPECT_LT(distance(newest_pose(truth).position(), stopped.position()), 1e-9);
}

}  // namespace
}  // namespace panonav::ros2
