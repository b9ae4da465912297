#include <cmath>
#include <fstream>
#include <limits>

#include "panonav/geometry/angles.hpp"
#include "ros2/node_on_the_wire.hpp"
#include "support/patch_views.hpp"

namespace panonav::ros2 {
namespace {

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
  const auto received = read<recordings::ros::PoseWithCovarianceStamped>(FastPeer::next(pose, 10s));
  EXPECT_EQ(received.header.frame_id, "map");
  const Pose2 found = recordings::ros::to_pose2(received.pose.pose);
  EXPECT_LT(distance(found.position(), truth.position()), 0.3);
  EXPECT_LT(std::abs(angle_difference(found.heading_rad, truth.heading_rad)), 0.2);
  for (const std::size_t i : {0U, 7U, 35U}) EXPECT_GT(received.pose.covariance[i], 0.0) << i;
  for (const std::size_t i : {14U, 21U, 28U}) EXPECT_EQ(received.pose.covariance[i], 0.0) << i;
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
  const Pose2 by_tf = recordings::ros::to_pose2(last.transforms[0].transform) * odometry(truth);
  EXPECT_LT(distance(by_tf.position(), truth.position()), 0.3);

  EXPECT_GT(read<recordings::ros::PoseArray>(FastPeer::next(particles, 1s)).poses.size(), 100U);
  const auto best_bytes = FastPeer::next(best, 1s);
  const auto match = read<recordings::ros::CompressedImage>(best_bytes);
  EXPECT_GT(recordings::ros::to_image(match, "best match").width(), 0);
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

TEST_F(LocalisationNodeOnTheWire, TakesNarrowPictures) {
  const fs::path path = *folder_ / "places.panonav";
  MemoriserOptions options{.source = PictureSource{}, .narrow = true, .map = false, .left_out = {}};
  options.source->layout.elevations = testing::patch_band;
  Memoriser memoriser(path, options);
  for (int i = 0; i < 9; ++i) {
    Observation view(testing::make_patch_view(static_cast<std::uint64_t>(i)));
    view.name = "place " + std::to_string(i);
    view.pose = ReferencePose{0.5 * i, 0.0, 0.0};
    memoriser.add(std::move(view));
  }
  memoriser.finish();
  LocalisationNodeSetup setup{.memory = path};
  setup.tracker.source =
      PictureSource{.kind = PictureKind::pinhole, .field_of_view_rad = radians(70.0)};
  start(setup);
  auto& odom = peer_.talk<recordings::ros::Odometry>("odom");
  auto& image = peer_.talk<recordings::ros::Image>("image", false);
  auto& pose = peer_.listen<recordings::ros::PoseWithCovarianceStamped>("panonav/pose");
  auto& best = peer_.listen<recordings::ros::CompressedImage>("panonav/best_match/compressed");
  ASSERT_TRUE(peer_.all_matched(10s));
  for (int i = 2; i < 7; ++i) {
    const std::int64_t ns = now_ns();
    FastPeer::write(odom, odometry_message(ns, {0.5 * i, 0.0, 0.0}));
    const Image seen = testing::take_narrow_picture(
        testing::make_patch_view(static_cast<std::uint64_t>(i)), 0.0, radians(70.0));
    EXPECT_TRUE(FastPeer::write(image, image_message(ns, seen)));
    ASSERT_TRUE(
        comes_true([&] { return node_->counts().pictures >= static_cast<std::size_t>(i - 1); }));
  }
  FastPeer::Bytes last;
  while (FastPeer::waiting(pose) > 0) last = FastPeer::next(pose, 1s);
  ASSERT_FALSE(last.empty());
  const Pose2 found =
      recordings::ros::to_pose2(read<recordings::ros::PoseWithCovarianceStamped>(last).pose.pose);
  EXPECT_LT(distance(found.position(), {3.0, 0.0}), 0.5);
  EXPECT_LT(std::abs(found.heading_rad), 0.2);
  EXPECT_FALSE(FastPeer::next(best, 1s).empty());
  EXPECT_NE(ask("repeat somewhere").find("narrow"), std::string::npos);
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
                        {{{ns, "odom"}, "base_footprint", recordings::ros::to_pose(odometry(at))},
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
                                                   {recordings::ros::to_pose(first), {}}};
  begin.pose.covariance[0] = begin.pose.covariance[7] = 0.01;
  begin.pose.covariance[35] = 0.01;
  FastPeer::write(start_pose, begin);
  std::this_thread::sleep_for(100ms);
  for (int i = 1; i < 12 || (i < 40 && FastPeer::waiting(pose) == 0); ++i) step(i);
  const auto received = FastPeer::next(pose, 10s);
  ASSERT_FALSE(received.empty());
  const auto received_pose = read<recordings::ros::PoseWithCovarianceStamped>(received);
  EXPECT_LT(received_pose.header.stamp_ns, 3'000'000'000);  // of the simulation
  const double truth_x_m =
      first.x_m + 0.05 * (1e-9 * static_cast<double>(received_pose.header.stamp_ns) / 0.05 - 1);
  EXPECT_NEAR(received_pose.pose.pose.position.x, truth_x_m, 0.3);
  EXPECT_NEAR(received_pose.pose.pose.position.y, first.y_m, 0.3);
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
