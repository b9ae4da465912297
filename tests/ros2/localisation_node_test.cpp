#include "panonav_ros2/localisation_node.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <mutex>
#include <thread>

#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav_ros2/simulated_robot.hpp"
#include "support/fast_peer.hpp"
#include "support/remembered_worlds.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::ros2 {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr ElevationBand band{-0.45, 0.6};

/// A robot in two rooms whose memory was made beforehand, and somebody else's programs around it.
class LocalisationNodeOnTheWire : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_.emplace();
    Memoriser memoriser(memory(), {.source = source()});
    int number = 0;
    for (double y = 0.4; y < 4.0; y += 0.4) {
      for (double x = 0.4; x < 8.0; x += 0.4) {
        if (!testing::robot_fits(world_, {x, y})) continue;
        Observation seen(picture({x, y, 0.0}));
        seen.name = "view_" + std::to_string(number++);
        seen.pose = ReferencePose{x, y, 0.0};
        memoriser.add(std::move(seen));
      }
    }
    memoriser.finish();
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static fs::path memory() { return *folder_ / "rooms.panonav"; }
  static PictureSource source() {
    PictureSource source{.kind = PictureKind::panorama};
    source.layout.elevations = band;
    return source;
  }
  static Image picture(const Pose2& pose) {
    return to_picture(world_.panorama(pose, 24, 128, band));
  }

  /// The last one that came; waits where none is there.
  static Pose2 newest_pose(FastPeer::Endpoint& poses) {
    FastPeer::Bytes last;
    while (FastPeer::waiting(poses) > 0) last = FastPeer::next(poses, 1s);
    if (last.empty()) last = FastPeer::next(poses, 10s);
    return recordings::ros::planar(read<recordings::ros::PoseStamped>(last).pose);
  }

  ~LocalisationNodeOnTheWire() override { stop(); }

  void start(LocalisationNodeOptions options = {}, const ParticipantOptions& participant = {}) {
    start({.memory = memory(), .participant = participant, .node = options});
  }
  void start(const LocalisationNodeSetup& setup) {
    node_.emplace(setup, [this](const std::string& line) {
      const std::lock_guard lock(mutex_);
      notes_.push_back(line);
    });
    thread_ = std::thread([this] { node_->run(); });
    // Both know of each other's participants: what either makes from now on is known at once.
    if (graph_ == nullptr) {
      graph_ = &peer_.listen("ros_discovery_info",
                             "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_", true, true);
    }
    EXPECT_FALSE(FastPeer::next(*graph_, 10s).empty());
  }
  void stop() {
    if (!thread_.joinable()) return;
    node_->stop();
    thread_.join();
  }
  [[nodiscard]] std::size_t notes_with(const std::string& words) {
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(std::ranges::count_if(
        notes_, [&](const auto& line) { return line.find(words) != std::string::npos; }));
  }
  bool comes_true(const std::function<bool()>& condition) {
    for (int i = 0; i < 500; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(20ms);
    }
    return false;
  }

  /// The answer on ~/command/result. Until the node has answered once it may not know of our writer
  /// yet: what nobody hears is said again.
  std::string ask(const std::string& words) {
    if (command_ == nullptr) {
      command_ = &peer_.talk<recordings::ros::String>("panonav/command");
      answer_ = &peer_.listen<recordings::ros::String>("panonav/command/result");
      EXPECT_TRUE(peer_.all_matched(10s));
      for (int i = 0; i < 50 && FastPeer::waiting(*answer_) == 0; ++i) {
        FastPeer::write(*command_, recordings::ros::String{"hello"});
        std::this_thread::sleep_for(100ms);
      }
    }
    while (!FastPeer::next(*answer_, 100ms).empty()) {
    }
    FastPeer::write(*command_, recordings::ros::String{words});
    const auto cdr = FastPeer::next(*answer_, 20s);
    return cdr.empty() ? "nothing" : read<recordings::ros::String>(cdr).data;
  }

  template <class Message>
  static Message read(const FastPeer::Bytes& cdr) {
    return recordings::ros::read_message<Message>(cdr, recordings::MessageEncoding::cdr);
  }
  static std::int64_t now_ns() {
    return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
  }
  /// The robot sees odometry from an origin of its own.
  static Pose2 odometry(const Pose2& pose) { return inverse(Pose2{1.0, 0.5, 0.4}) * pose; }
  static recordings::ros::Odometry odometry_message(std::int64_t ns, const Pose2& pose) {
    recordings::ros::Odometry message;
    message.header = {ns, "odom"};
    message.child_frame_id = "base_link";
    message.pose.pose = recordings::ros::pose_of(odometry(pose));
    return message;
  }
  static FastPeer::Bytes image_message(std::int64_t ns, const Image& picture) {
    return recordings::ros::write_message(
        recordings::ros::Image{{ns, "camera"},
                               static_cast<std::uint32_t>(picture.height()),
                               static_cast<std::uint32_t>(picture.width()),
                               "mono8",
                               0,
                               static_cast<std::uint32_t>(picture.width()),
                               picture.pixels()});
  }
  /// Through the first room, 5 cm and 25 ms a step, or somewhat longer until the node has seen it,
  /// with odometry before and after each picture.
  Pose2 drive(FastPeer::Endpoint& odom, const std::function<void(std::int64_t, const Pose2&)>& see,
              int steps = 40) {
    Pose2 pose{0.6, 0.8, 0.0};
    for (int i = 0; i < steps; ++i) {
      const std::int64_t ns = now_ns();
      EXPECT_TRUE(FastPeer::write(odom, odometry_message(ns, pose)));
      const auto looked_at = [&] { return node_->counts().pictures + node_->counts().dropped; };
      const std::size_t before = looked_at();
      see(ns, pose);
      for (int wait = 0; wait < 5 && (wait == 0 || looked_at() == before); ++wait) {
        std::this_thread::sleep_for(25ms);
      }
      if (i + 1 < steps) pose = pose * Pose2{0.05, 0.0, i > 20 ? 0.05 : 0.0};
    }
    return pose;
  }

  inline static std::optional<testing::TemporaryFolder> folder_;
  inline static const testing::ToyWorld world_ = testing::two_rooms(3, false);
  std::mutex mutex_;
  std::vector<std::string> notes_;
  FastPeer peer_;
  std::optional<LocalisationNode> node_;
  std::thread thread_;
  FastPeer::Endpoint *graph_ = nullptr, *command_ = nullptr, *answer_ = nullptr;
};

TEST_F(LocalisationNodeOnTheWire, TellsAnotherVendorsProgramsWhereTheRobotIs) {
  start({}, {.name_space = "/robot", .remappings = {{"image", "/camera/image_raw"}}});
  auto& tf = peer_.listen<recordings::ros::TFMessage>("tf");
  auto& particles = peer_.listen<recordings::ros::PoseArray>("robot/panonav/particles");
  auto& best =
      peer_.listen<recordings::ros::CompressedImage>("robot/panonav/best_match/compressed");
  auto& diagnostics = peer_.listen<recordings::ros::DiagnosticArray>("diagnostics");
  auto& odom = peer_.talk<recordings::ros::Odometry>("robot/odom");
  auto& image = peer_.talk<recordings::ros::Image>("camera/image_raw", false);
  ASSERT_TRUE(peer_.all_matched(10s));
  const Pose2 truth = drive(odom, [&](std::int64_t ns, const Pose2& pose) {
    EXPECT_TRUE(FastPeer::write(image, image_message(ns, picture(pose))));
  });
  ASSERT_TRUE(comes_true([&] { return node_->counts().pictures >= 20; }));
  EXPECT_GE(node_->counts().localised, 10U);

  // Who comes later hears the last pose, and the references.
  auto& pose =
      peer_.listen<recordings::ros::PoseWithCovarianceStamped>("robot/panonav/pose", true, true);
  auto& references =
      peer_.listen<recordings::ros::PointCloud2>("robot/panonav/references", true, true);
  const auto told = read<recordings::ros::PoseWithCovarianceStamped>(FastPeer::next(pose, 10s));
  EXPECT_EQ(told.header.frame_id, "map");
  const Pose2 found = recordings::ros::planar(told.pose.pose);
  EXPECT_LT(distance(found.position(), truth.position()), 0.3);
  EXPECT_LT(std::abs(angle_difference(found.heading_rad, truth.heading_rad)), 0.2);
  for (const std::size_t i : {0U, 7U, 35U}) EXPECT_GT(told.pose.covariance[i], 0.0) << i;
  for (const std::size_t i : {14U, 21U, 28U}) EXPECT_EQ(told.pose.covariance[i], 0.0) << i;
  const auto cloud_bytes = FastPeer::next(references, 10s);
  const auto cloud = read<recordings::ros::PointCloud2>(cloud_bytes);
  EXPECT_EQ(cloud.header.frame_id, "map");
  EXPECT_GT(cloud.width, 100U);
  EXPECT_EQ(cloud.data.size(), 16U * cloud.width);

  // map -> odom, dated ahead, with the odometry's own odom -> base_link where the robot is.
  std::size_t transforms = 0;
  recordings::ros::TFMessage last;
  while (FastPeer::waiting(tf) > 0) {
    const auto message = read<recordings::ros::TFMessage>(FastPeer::next(tf, 1s));
    ASSERT_EQ(message.transforms.size(), 1U);
    if (transforms++ > 0) {
      EXPECT_GT(message.transforms[0].header.stamp_ns, last.transforms[0].header.stamp_ns);
    }
    last = message;
  }
  EXPECT_GT(transforms, 40U);  // many between two pictures
  EXPECT_EQ(last.transforms[0].header.frame_id, "map");
  EXPECT_EQ(last.transforms[0].child_frame_id, "odom");
  EXPECT_GT(last.transforms[0].header.stamp_ns, now_ns());
  EXPECT_LT(last.transforms[0].header.stamp_ns, now_ns() + 1'000'000'000);
  const Pose2 by_tf = recordings::ros::planar(last.transforms[0].transform) * odometry(truth);
  EXPECT_LT(distance(by_tf.position(), truth.position()), 0.3);

  EXPECT_GT(read<recordings::ros::PoseArray>(FastPeer::next(particles, 1s)).poses.size(), 100U);
  const auto best_bytes = FastPeer::next(best, 1s);
  const auto match = read<recordings::ros::CompressedImage>(best_bytes);
  EXPECT_GT(recordings::ros::picture_of(match, "best match").width(), 0);
  std::map<std::string, std::string> values;
  std::string state;
  while (FastPeer::waiting(diagnostics) > 0) {
    const auto message = read<recordings::ros::DiagnosticArray>(FastPeer::next(diagnostics, 1s));
    for (const auto& [key, value] : message.status.at(0).values) values[key] = value;
    state = message.status.at(0).level == 0 ? message.status.at(0).message : state;
  }
  EXPECT_EQ(state, "localised");
  for (const char* key : {"probability", "correction_m", "correction_rad", "delay_ms"}) {
    EXPECT_TRUE(values.contains(key)) << key;
  }
  stop();
  EXPECT_TRUE(notes_.empty()) << notes_.front();
}

TEST_F(LocalisationNodeOnTheWire, TakesCompressedPicturesTransformsASimulatedClockAndAStart) {
  start({.motion = MotionInput::tf,
         .pictures = PictureInput::compressed,
         .use_sim_time = true,
         .tilt_from_imu = true});
  auto& tf = peer_.talk<recordings::ros::TFMessage>("tf");
  auto& heard = peer_.listen<recordings::ros::TFMessage>("tf");
  auto& clock = peer_.talk<recordings::ros::Clock>("clock", false);
  auto& imu = peer_.talk<recordings::ros::Imu>("imu");
  auto& image = peer_.talk<recordings::ros::CompressedImage>("image/compressed");
  auto& start_pose = peer_.talk<recordings::ros::PoseWithCovarianceStamped>("initialpose");
  auto& pose = peer_.listen<recordings::ros::PoseWithCovarianceStamped>("panonav/pose");
  ASSERT_TRUE(peer_.all_matched(10s));
  const Pose2 first{0.6, 0.8, 0.0};
  const auto step = [&](int i) {
    const std::int64_t ns = 50'000'000LL * (i + 1);
    const Pose2 at{first.x_m + 0.05 * i, first.y_m, 0.0};
    FastPeer::write(clock, recordings::ros::Clock{ns});
    FastPeer::write(tf,
                    recordings::ros::TFMessage{
                        {{{ns, "odom"}, "base_footprint", recordings::ros::pose_of(odometry(at))},
                         {{ns, "base_footprint"}, "base_link", {}}}});
    recordings::ros::Imu level;
    level.header = {ns, "imu"};
    FastPeer::write(imu, level);
    const Image seen = picture(at);
    const auto png = encode_png(seen.view());
    FastPeer::write(image, recordings::ros::CompressedImage{{ns, "camera"}, "png", png});
    std::this_thread::sleep_for(50ms);
  };
  step(0);
  recordings::ros::PoseWithCovarianceStamped begin{{0, "map"},
                                                   {recordings::ros::pose_of(first), {}}};
  begin.pose.covariance[0] = begin.pose.covariance[7] = 0.01;
  begin.pose.covariance[35] = 0.01;
  FastPeer::write(start_pose, begin);
  std::this_thread::sleep_for(100ms);
  for (int i = 1; i < 12 || (i < 40 && FastPeer::waiting(pose) == 0); ++i) step(i);
  const auto told = FastPeer::next(pose, 10s);
  ASSERT_FALSE(told.empty());
  const auto told_pose = read<recordings::ros::PoseWithCovarianceStamped>(told);
  EXPECT_LT(told_pose.header.stamp_ns, 3'000'000'000);  // of the simulation
  const double truth_x_m =
      first.x_m + 0.05 * (1e-9 * static_cast<double>(told_pose.header.stamp_ns) / 0.05 - 1);
  EXPECT_NEAR(told_pose.pose.pose.position.x, truth_x_m, 0.3);
  EXPECT_NEAR(told_pose.pose.pose.position.y, first.y_m, 0.3);
  bool dated_ahead = false;
  for (int i = 40; i < 80 && !dated_ahead; ++i) {  // a clock that stands brings no transform
    step(i);
    while (FastPeer::waiting(heard) > 0) {
      const auto message = read<recordings::ros::TFMessage>(FastPeer::next(heard, 1s));
      if (message.transforms.at(0).child_frame_id != "odom") continue;
      dated_ahead = true;
      EXPECT_GT(message.transforms[0].header.stamp_ns, 1'000'000'000);
      EXPECT_LE(message.transforms[0].header.stamp_ns, 5'100'000'000);
    }
  }
  EXPECT_TRUE(dated_ahead);
  stop();
  EXPECT_TRUE(notes_.empty()) << notes_.front();
}

TEST_F(LocalisationNodeOnTheWire, BadMessagesGetOneLineEachAndTheRobotIsFoundAllTheSame) {
  start();
  auto& odom = peer_.talk<recordings::ros::Odometry>("odom");
  auto& image = peer_.talk<recordings::ros::Image>("image");
  auto& start_pose = peer_.talk<recordings::ros::PoseWithCovarianceStamped>("initialpose");
  (void)peer_.talk<recordings::ros::Odometry>("odom");  // a second publisher, which is silent
  ASSERT_TRUE(peer_.all_matched(10s));

  int number = 0;
  const std::int64_t begin_ns = now_ns();
  // Not at once: what is written before both sides know of each other may be lost.
  drive(odom, [&](std::int64_t ns, const Pose2& pose) {
    const auto good = image_message(ns, picture(pose));
    switch (++number) {
      case 21: {  // half a message, nothing, noise
        FastPeer::write(image, {good.begin(), good.begin() + 200});
        FastPeer::write(image, {0, 1, 0, 0, 0, 0, 0, 0});
        FastPeer::Bytes noise(64, 0xFF);
        noise[0] = 0;
        noise[1] =
            1;  // little endian; Cyclone DDS drops packets with encodings that it does not know
        FastPeer::write(image, noise);
        break;
      }
      case 22: {  // a picture of another size and one of no known encoding
        const Image other(30, 20);
        FastPeer::write(image, image_message(ns + 1, other));
        std::this_thread::sleep_for(30ms);
        recordings::ros::Image strange{{ns + 2, "camera"}, 1, 1, "rgb565", 0, 2, {}};
        FastPeer::write(image, strange);
        break;
      }
      case 23: {  // odometry that is no number, of another robot, and late
        auto bad = odometry_message(ns + 1, pose);
        bad.pose.pose.position.x = std::numeric_limits<double>::quiet_NaN();
        FastPeer::write(odom, bad);
        auto foreign = odometry_message(ns + 2, pose);
        foreign.header.frame_id = "other_odom";
        FastPeer::write(odom, foreign);
        FastPeer::write(odom, odometry_message(ns - 1000, pose));
        break;
      }
      case 24: {
        recordings::ros::PoseWithCovarianceStamped nowhere{{0, "moon"}, {}};
        FastPeer::write(start_pose, nowhere);
        FastPeer::write(image, image_message(begin_ns - 10'000'000, picture(pose)));
        break;
      }
      default:
        FastPeer::write(image, good);
    }
  });
  ASSERT_TRUE(comes_true([&] { return node_->counts().localised >= 10; }));
  ASSERT_TRUE(comes_true([&] { return notes_with("publishers") > 0; }));
  stop();
  for (const char* words :
       {"warning: image: sensor_msgs/Image message: ", "warning: odom: nav_msgs/Odometry message: ",
        "2 publishers", "moon", "odom: a stamp is not after the one before it"}) {
    EXPECT_EQ(notes_with(words), 1U) << words;
  }
  EXPECT_LE(notes_.size(), 9U);
  EXPECT_GT(node_->counts().notes, notes_.size());  // the rest of each kind was kept back
}

TEST_F(LocalisationNodeOnTheWire, TransformsThatAreMissingOrGoRoundGetOneLineEach) {
  start({.motion = MotionInput::tf});
  auto& tf = peer_.talk<recordings::ros::TFMessage>("tf");
  auto& image = peer_.talk<recordings::ros::Image>("image");
  ASSERT_TRUE(peer_.all_matched(10s));
  const Image seen = picture({0.6, 0.8, 0.0});
  const auto is_said = [&](const std::string& words, const std::string& parent) {
    for (int i = 0; i < 200 && notes_with(words) == 0; ++i) {
      const std::int64_t ns = now_ns();
      FastPeer::write(tf, recordings::ros::TFMessage{{{{ns, "odom"}, "wheel", {}},
                                                      {{ns, parent}, "base_link", {}},
                                                      {{ns, "base_link"}, "foot", {}}}});
      FastPeer::write(image, image_message(ns, seen));
      std::this_thread::sleep_for(20ms);
    }
    return notes_with(words) == 1;
  };
  EXPECT_TRUE(is_said("(TF from odom to base_link)", "nowhere"));
  EXPECT_TRUE(is_said("a cycle", "foot"));
  EXPECT_EQ(node_->counts().pictures, 0U);
}

TEST_F(LocalisationNodeOnTheWire, AFloodOfMessagesLeavesItLocalisedWithinItsMemory) {
  start();
  auto& odom = peer_.talk<recordings::ros::Odometry>("odom", false);
  auto& image = peer_.talk<recordings::ros::Image>("image", false);
  ASSERT_TRUE(peer_.all_matched(10s));
  const auto resident_pages = [] {
    std::size_t total = 0;
    std::size_t resident = 0;
    std::ifstream("/proc/self/statm") >> total >> resident;
    return resident;
  };
  const std::size_t before = resident_pages();
  drive(odom, [&](std::int64_t ns, const Pose2& pose) {
    const Image seen = picture(pose);
    for (int i = 0; i < 50; ++i) {  // 1,000 a second
      FastPeer::write(odom, odometry_message(ns + i + 1, pose));
      FastPeer::write(image, image_message(ns + i, seen));
    }
  });
  ASSERT_TRUE(comes_true([&] { return node_->counts().localised >= 3; }));
  EXPECT_GT(node_->counts().dropped, 0U);
  EXPECT_LT(resident_pages(), before + (64U << 20U) / 4096U);
}

/// In the first of the two rooms, faster than life.
class DrivenRobot {
 public:
  explicit DrivenRobot(const testing::ToyWorld& world,
                       std::function<Image(const Pose2& pose)> picture, double time_factor)
      : robot_({.node = "robot"}, {.time_factor = time_factor},
               {{0.8, 0.8, 0.3},
                [&world](Point2 place) { return testing::robot_fits(world, place); },
                [picture](const Pose2& pose, std::uint64_t) { return picture(pose); }},
               {}, 1, [](const std::string& line) { ADD_FAILURE() << line; }),
        thread_([this] { robot_.run(); }) {}
  ~DrivenRobot() {
    robot_.stop();
    thread_.join();
  }

 private:
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
                              {0, "map"}, recordings::ros::pose_of({place.x_m, place.y_m, 0.0})});
    return state_of(FastPeer::next(feedback, 20s));
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
                      {0, "map"}, recordings::ros::pose_of({elsewhere.x_m, elsewhere.y_m, 2.0})});
  EXPECT_TRUE(comes_true([&] {
    const auto told = FastPeer::next(pose, 1s);
    return !told.empty() && node_->counts().pictures > before &&
           distance(recordings::ros::planar(
                        read<recordings::ros::PoseWithCovarianceStamped>(told).pose.pose)
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

  const auto carried_back = [&] {
    FastPeer::write(set_pose, recordings::ros::PoseStamped{
                                  {0, "map"}, recordings::ros::pose_of({0.8, 0.8, 0.2})});
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

  // What a node leaves that is killed on its way is there when another one starts.
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
  EXPECT_EQ(notes_with("the robot is not sent on"), 1U);
  EXPECT_FALSE(fs::exists(mission));
  stop();
  write_file(mission, std::string_view("1 2 3 repeat"));
  start(setup);
  EXPECT_EQ(notes_with("is damaged"), 1U);
}

TEST_F(LocalisationNodeOnTheWire, DoesWhatUsersAskForAndSaysSo) {
  start();
  auto& odom = peer_.talk<recordings::ros::Odometry>("odom");
  auto& image = peer_.talk<recordings::ros::Image>("image");
  const fs::path own = *folder_ / "own.panonav";
  fs::copy_file(memory(), own);
  fs::create_symlink("/etc/hostname", *folder_ / "linked.panonav");
  ASSERT_TRUE(peer_.all_matched(10s));
  EXPECT_EQ(ask("dance").find("refused: command is 'dance'; allowed: relocalise, "), 0U);
  EXPECT_NE(ask("add here").find("refused: the robot is not localised"), std::string::npos);
  for (const char* outside : {"/nowhere.panonav", "../own.panonav", "linked.panonav"}) {
    EXPECT_EQ(ask(std::string("load ") + outside).find("refused: file to load is '"), 0U);
  }
  EXPECT_NE(ask("load nowhere.panonav").find("nowhere.panonav"), std::string::npos);
  EXPECT_EQ(ask("load own.panonav"), "load done");
  const auto see = [&](std::int64_t ns, const Pose2& pose) {
    FastPeer::write(image, image_message(ns, picture(pose)));
  };
  drive(odom, see);
  ASSERT_TRUE(comes_true([&] { return node_->counts().localised >= 5; }));
  EXPECT_EQ(ask("add corner"), "add done");
  {
    const auto file = MemoryFile::open(own, Access::read_only);
    ASSERT_TRUE(file.find("corner"));
    EXPECT_TRUE(file.load().info(*file.find("corner")).pose);
  }
  EXPECT_EQ(ask("forget corner"), "forget done");
  EXPECT_FALSE(MemoryFile::open(own, Access::read_only).find("corner"));
  EXPECT_EQ(ask("relocalise"), "relocalise done");
  const std::size_t localised = node_->counts().localised;
  drive(odom, see);
  EXPECT_TRUE(comes_true([&] { return node_->counts().localised > localised; }));
}

}  // namespace
}  // namespace panonav::ros2
