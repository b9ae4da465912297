// Recordings of topics as data sets, whatever file holds them.
#include "panonav_recordings/recorded_dataset.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_recordings/recorded_poses.hpp"
#include "support/picture_samples.hpp"
#include "support/recorded_messages.hpp"
#include "support/text.hpp"

namespace panonav::recordings {
using namespace testing;
namespace {

constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t start_ns = 1'700'000'000'000 * ms;

/// Turns through the branch cut at pi while it moves.
Pose2 pose_at(double s) {
  return {0.5 * s, -0.25 * s, wrap_angle(2.9 + 0.4 * s)};
}

const PictureSource sphere{.kind = PictureKind::equirectangular,
                           .layout = {.elevations = ElevationBand{-1.5707963, 1.5707963}}};

class RecordedTopics : public ::testing::TestWithParam<MessageEncoding> {
 protected:
  void add_picture(std::int64_t after_ns, const std::string& topic = "/camera") {
    const Image image = random_image(random_, 8, 4, 3);
    ros::Image message;
    message.header = {start_ns + after_ns, "camera"};
    message.width = 8;
    message.height = 4;
    message.step = 24;
    message.encoding = "rgb8";
    message.data = image.pixels();
    recorded_->add(topic, start_ns + after_ns + 30 * ms, message);  // it took its time
    images_.push_back(image);
  }
  void add_odometry(std::int64_t after_ns, const std::string& topic = "/odom") {
    ros::Odometry message;
    message.header = {start_ns + after_ns, "odom"};
    message.child_frame_id = "base_link";
    message.pose.pose = ros::to_pose(pose_at(1e-9 * static_cast<double>(after_ns)));
    recorded_->add(topic, start_ns + after_ns + 2 * ms, message);
  }
  void add_transform(const std::string& topic, const std::string& parent, const std::string& child,
                     std::int64_t after_ns, const Pose2& pose) {
    recorded_->add(topic, start_ns + after_ns,
                   ros::TFMessage{{{{start_ns + after_ns, parent}, child, ros::to_pose(pose)}}});
  }
  void add_imu(std::int64_t after_ns, const Tilt& tilt, const std::string& topic = "/imu") {
    ros::Imu message;
    message.header = {start_ns + after_ns, "imu"};
    message.orientation = ros::to_pose({0.0, 0.0, 1.2}, tilt).orientation;
    recorded_->add(topic, start_ns + after_ns, message);
  }
  [[nodiscard]] Dataset read(const InputOptions::Topics& topics = {},
                             const PictureSource& source = sphere) const {
    return read_recording(recorded_, "drive.bag", source, topics);
  }
  [[nodiscard]] std::string error(const InputOptions::Topics& topics = {}) const {
    return message_of<FileError>([&] { (void)read(topics); });
  }
  void expect_odometry(const DatasetEntry& entry, std::int64_t after_ns) {
    ASSERT_TRUE(entry.odometry);
    const Pose2 expected = pose_at(1e-9 * static_cast<double>(after_ns));
    EXPECT_NEAR(entry.odometry->x_m, expected.x_m, 1e-9);
    EXPECT_NEAR(entry.odometry->y_m, expected.y_m, 1e-9);
    EXPECT_NEAR(angle_difference(entry.odometry->heading_rad, expected.heading_rad), 0.0, 1e-9);
  }

  Random random_{5};
  std::shared_ptr<RecordedMessages> recorded_ = std::make_shared<RecordedMessages>(GetParam());
  std::vector<Image> images_;
};
INSTANTIATE_TEST_SUITE_P(Encodings, RecordedTopics,
                         ::testing::Values(MessageEncoding::ros1, MessageEncoding::cdr),
                         [](const auto& each) {
                           return each.param == MessageEncoding::ros1 ? "Ros1" : "Cdr";
                         });

TEST_P(RecordedTopics, BecomePicturesWithStampsAndOdometry) {
  for (int i = -1; i <= 20; ++i) add_odometry(i * 100 * ms);
  for (int i = 0; i < 8; ++i) add_picture(i * 240 * ms + 7);
  const Dataset dataset = read();
  EXPECT_TRUE(dataset.warnings.empty()) << dataset.warnings[0];
  ASSERT_EQ(dataset.entries.size(), 8U);
  EXPECT_EQ(dataset.source, sphere);
  EXPECT_EQ(dataset.entries[1].file, "1700000000_240000007");
  for (std::size_t i = 0; i < 8; ++i) {
    const DatasetEntry& entry = dataset.entries[i];
    const std::int64_t after_ns = static_cast<std::int64_t>(i) * 240 * ms + 7;
    EXPECT_EQ(read_picture(entry), images_[i]);
    EXPECT_EQ(entry.path, "drive.bag");
    EXPECT_NEAR(*entry.stamp_s, 1.7e9 + 1e-9 * static_cast<double>(after_ns), 3e-7);
    expect_odometry(entry, after_ns);
    EXPECT_FALSE(entry.tilt);
    EXPECT_FALSE(entry.pose);
    EXPECT_EQ(entry.store->encoded(i), std::nullopt);
    EXPECT_EQ(decode_image(read_encoded_picture(entry), "png"), images_[i]);
  }
}

TEST_P(RecordedTopics, OdometryEndsAnIntervalBeyondItsLastMessage) {
  for (const int after_ms : {500, 600, 700, 1800, 1900}) add_odometry(after_ms * ms);
  // The span is 500 .. 1900 with a gap of 1.1 s; extrapolation reaches 100 ms further.
  const std::vector<std::pair<int, bool>> expected{{399, false},  {401, true},  {600, true},
                                                   {1000, false}, {1800, true}, {1999, true},
                                                   {2001, false}};
  for (const auto& [after_ms, has] : expected) add_picture(after_ms * ms);
  const auto read_back = read();
  for (std::size_t i = 0; i < expected.size(); ++i) {
    SCOPED_TRACE(expected[i].first);
    const DatasetEntry& entry = read_back.entries[i];
    EXPECT_EQ(entry.odometry.has_value(), expected[i].second);
    if (expected[i].second) expect_odometry(entry, expected[i].first * ms);
  }
  ASSERT_EQ(read_back.warnings.size(), 1U);
  EXPECT_EQ(
      read_back.warnings[0],
      "3 of 7 images have no odometry: 1 before its first message, 1 in pauses of more than a "
      "second, 1 after its last message");
}

// Without a message in every second, nothing better than the mean of the neighbours is known.
TEST_P(RecordedTopics, OdometryThatAlwaysComesSlowlyIsInterpolated) {
  for (int i = 0; i <= 4; ++i) add_odometry(i * 1400 * ms);
  add_odometry(8400 * ms);  // one is missing
  for (const int after_ms : {700, 2100, 6900}) add_picture(after_ms * ms);
  const auto read_back = read();
  EXPECT_TRUE(read_back.entries[0].odometry && read_back.entries[1].odometry);
  EXPECT_FALSE(read_back.entries[2].odometry);
  ASSERT_EQ(read_back.warnings.size(), 1U);
  EXPECT_TRUE(contains(read_back.warnings[0], "1 of 3 images have no odometry: 1 in pauses"));
}

TEST_P(RecordedTopics, TransformsGiveOdometryAlongTheirChain) {
  const Pose2 mount{0.3, -0.1, 0.5};
  add_transform("/tf_static", "/base_footprint", "base_link", -5000 * ms, mount);
  add_transform("/tf", "map", "odom", 0, {7.0, 7.0, 1.0});
  for (int i = 0; i <= 20; ++i) {
    add_transform("/tf", "odom", "base_footprint", i * 100 * ms, pose_at(0.1 * i));
    add_transform("/tf", "base_link", "wheel", i * 100 * ms, {0.0, 0.3, 0.1 * i});
  }
  add_picture(650 * ms);
  const auto entry = read().entries.at(0);
  const Pose2 expected = pose_at(0.65) * mount;
  ASSERT_TRUE(entry.odometry);
  EXPECT_NEAR(entry.odometry->x_m, expected.x_m, 1e-9);
  EXPECT_NEAR(entry.odometry->y_m, expected.y_m, 1e-9);
  EXPECT_NEAR(entry.odometry->heading_rad, expected.heading_rad, 1e-9);

  const auto other = read({.odometry_frames = std::pair{"odom", "base_footprint"}});
  expect_odometry(other.entries[0], 650 * ms);
  EXPECT_TRUE(contains(error({.odometry_frames = std::pair{"odom", "arm"}}),
                       "drive.bag: no transforms lead from odom to arm; it has: "));
  // Who changes the parent is not believed.
  add_transform("/tf", "elsewhere", "base_footprint", 640 * ms, {50.0, 0.0, 0.0});
  const auto changed = read();
  EXPECT_EQ(changed.entries[0].odometry, entry.odometry);
  EXPECT_EQ(changed.warnings.at(0),
            "1 transforms give a frame another parent than before and are left out");
}

TEST_P(RecordedTopics, TransformsToAnotherBaseAreFoundOrNamed) {
  for (int i = 0; i <= 10; ++i) {
    add_transform("/tf", "odom", "base_footprint", i * 100 * ms, pose_at(0.1 * i));
  }
  add_picture(650 * ms);
  const auto found = read();
  EXPECT_TRUE(found.warnings.empty());
  ASSERT_TRUE(found.entries.at(0).odometry);
  EXPECT_NEAR(found.entries[0].odometry->x_m, pose_at(0.65).x_m, 1e-9);
}

TEST_P(RecordedTopics, TransformsThatGiveNoOdometryAreNamed) {
  for (int i = 0; i <= 10; ++i) {
    add_transform("/tf", "t265_odom", "t265", i * 100 * ms, pose_at(0.1 * i));
  }
  add_picture(650 * ms);
  const auto found = read();
  EXPECT_FALSE(found.entries.at(0).odometry);
  ASSERT_EQ(found.warnings.size(), 1U);
  EXPECT_TRUE(
      contains(found.warnings[0],
               "no odometry: no transforms lead from odom to base_link or base_footprint; "
               "it has: t265_odom -> t265; choose two frames with the option odometry_frames"));
}

TEST_P(RecordedTopics, TransformsInACircleConnectNothing) {
  add_transform("/tf", "a", "base_link", 0, {});
  add_transform("/tf", "b", "a", 0, {});
  add_transform("/tf", "base_link", "b", 0, {});
  add_picture(0);
  EXPECT_FALSE(read().entries[0].odometry);
  EXPECT_TRUE(contains(error({.odometry_frames = std::pair{"odom", "base_link"}}),
                       "no transforms lead from odom to base_link"));
  EXPECT_THROW((void)read({.odometry_frames = std::pair{"odom", "/odom"}}), ContractError);
  EXPECT_THROW((void)read({.odometry = "/odom", .odometry_frames = std::pair{"odom", "b"}}),
               ContractError);
}

TEST_P(RecordedTopics, TopicsAreChosenByTypeOrNamed) {
  EXPECT_TRUE(contains(error(), "drive.bag: has no images that can be read (sensor_msgs/Image"));
  EXPECT_TRUE(contains(error(), "; its topics: none"));
  add_picture(0, "/left");
  add_picture(0, "/right");
  add_odometry(0, "/wheels");
  add_odometry(0, "/filtered");
  add_imu(0, {}, "/imu0");
  add_imu(0, {}, "/imu1");
  const auto chosen = read();
  EXPECT_EQ(read_picture(chosen.entries.at(0)), images_[0]);
  EXPECT_EQ(chosen.warnings.at(0),
            "images of several topics: /left, /right; used: /left; choose another with the option "
            "image_topic");
  const auto right = read({.image = "/right"});
  EXPECT_EQ(read_picture(right.entries.at(0)), images_[1]);
  EXPECT_FALSE(right.entries[0].odometry);
  ASSERT_EQ(right.warnings.size(), 2U);
  EXPECT_EQ(right.warnings[0],
            "odometry of several topics, of which none is used: /filtered, /wheels; choose one "
            "with the option odometry_topic");
  EXPECT_EQ(right.warnings[1],
            "inertial sensors of several topics, of which none is used: /imu0, /imu1; choose one "
            "with the option imu_topic");
  const auto named = read({.image = "/right", .odometry = "/wheels", .imu = "/imu1"});
  EXPECT_TRUE(named.warnings.empty());
  EXPECT_TRUE(named.entries[0].odometry && named.entries[0].tilt);
  EXPECT_TRUE(
      contains(error({.image = "/imu0"}), "drive.bag: has no topic /imu0 of sensor_msgs/I"));
  EXPECT_EQ(error({.image = "/left", .odometry = "/none"}),
            "drive.bag: has no topic /none of nav_msgs/Odometry; it has: /filtered "
            "(nav_msgs/Odometry), /imu0 (sensor_msgs/Imu), /imu1 (sensor_msgs/Imu), /left "
            "(sensor_msgs/Image), /right (sensor_msgs/Image), /wheels (nav_msgs/Odometry)");
}

TEST_P(RecordedTopics, HostileNamesStayOnOneLine) {
  add_picture(0, "/left\n\x1b[2J");
  add_picture(0, std::string(5000, 'x'));
  for (const std::string& line : {read().warnings.at(0), error({.image = "/up"})}) {
    EXPECT_EQ(line.find_first_of("\n\x1b"), std::string::npos);
    EXPECT_LE(line.size(), 6000U);
  }
}

TEST_P(RecordedTopics, WithoutStampsTheTimesOfRecordingServe) {
  for (int i = 0; i <= 10; ++i) add_odometry(i * 100 * ms);
  ros::CompressedImage message;
  const Image image = random_image(random_, 5, 4, 1);
  const auto png = encode_png(image.view());
  message.data = png;
  message.format = "png";
  recorded_->add("/camera", start_ns + 502 * ms, message);
  const Dataset dataset = read();
  ASSERT_EQ(dataset.warnings.size(), 1U);
  EXPECT_EQ(dataset.warnings[0], "headers without stamps: the times of recording are used instead");
  EXPECT_EQ(dataset.entries[0].file, "1700000000_502000000");
  expect_odometry(dataset.entries[0], 500 * ms);  // which is recorded 2 ms later
  EXPECT_EQ(read_encoded_picture(dataset.entries[0]), png);
  EXPECT_EQ(read_picture(dataset.entries[0]), image);
}

TEST_P(RecordedTopics, TiltIsThatOfAnUprightSensor) {
  add_imu(0, {0.1, -0.2});
  add_imu(100 * ms, {0.1, -0.2});
  add_imu(300 * ms, {1.6, 0.0});
  add_imu(400 * ms, {1.6, 0.0});
  add_picture(40 * ms);
  add_picture(350 * ms);
  const auto read_back = read();
  ASSERT_TRUE(read_back.entries[0].tilt);
  EXPECT_NEAR(read_back.entries[0].tilt->roll_rad, 0.1, 1e-12);
  EXPECT_NEAR(read_back.entries[0].tilt->pitch_rad, -0.2, 1e-12);
  EXPECT_FALSE(read_back.entries[1].tilt);
  EXPECT_TRUE(contains(read_back.warnings.at(0), "1 of 2 images would be tilted by more than 30"));
  // Panoramas that cannot be levelled.
  const auto unknown = read({}, {});
  EXPECT_FALSE(unknown.entries[0].tilt);
  EXPECT_TRUE(contains(unknown.warnings.at(0), "roll and pitch of /imu are not used"));
  EXPECT_TRUE(read({.imu = "/imu"}, {}).entries[0].tilt);
}

TEST_P(RecordedTopics, SensorsWithoutOrientationGiveNoTilt) {
  ros::Imu message;
  message.orientation_covariance[0] = -1.0;
  message.header.stamp_ns = start_ns;
  recorded_->add("/imu", start_ns, message);
  add_picture(0);
  const auto read_back = read();
  EXPECT_FALSE(read_back.entries[0].tilt);
  EXPECT_TRUE(contains(read_back.warnings.at(0), "1 messages of the inertial sensor state no"));
}

TEST_P(RecordedTopics, DamagedMessagesAreLeftOut) {
  for (int i = 0; i <= 4; ++i) add_odometry(i * 100 * ms);
  ros::Odometry wrong;
  wrong.header.stamp_ns = start_ns + 150 * ms;
  wrong.pose.pose.position.x = std::nan("");
  recorded_->add("/odom", start_ns + 151 * ms, wrong);
  add_picture(150 * ms);
  add_picture(150 * ms);  // the same stamp
  add_picture(140 * ms);
  ros::Image late;  // recorded last
  late.header.stamp_ns = start_ns + 100 * ms;
  recorded_->add("/camera", start_ns + 400 * ms, late);
  recorded_->add("/camera", "sensor_msgs/Image", start_ns + 500 * ms, {1, 2, 3});
  const Dataset dataset = read();
  ASSERT_EQ(dataset.entries.size(), 3U);
  expect_odometry(dataset.entries[2], 150 * ms);
  ASSERT_EQ(dataset.warnings.size(), 4U);
  EXPECT_TRUE(contains(dataset.warnings[0],
                       "left out: 2 messages that cannot be read; the first: "
                       "nav_msgs/Odometry message: position is nan"));
  EXPECT_EQ(dataset.warnings[1],
            "2 of 4 images were recorded late; all are used in the order of their stamps");
  EXPECT_EQ(dataset.warnings[2],
            "1 of 4 images have the stamp of another image; the first image of each stamp is used");
  EXPECT_EQ(dataset.warnings[3], "1 of 3 images are not of the size of the first, 8 x 4 px");
  EXPECT_EQ(dataset.entries[0].file, "1700000000_100000000");
  EXPECT_EQ(dataset.entries[1].file, "1700000000_140000000");
  EXPECT_EQ(dataset.entries[2].file, "1700000000_150000000");
  EXPECT_EQ(read_picture(dataset.entries[2]), images_[0]);
}

TEST_P(RecordedTopics, GroundTruthGivesPoses) {
  add_picture(0);
  add_picture(500 * ms);
  for (int i = 0; i <= 10; ++i) {
    const std::int64_t after_ns = i * 100 * ms;
    recorded_->add(
        "/ground_truth", start_ns + after_ns,
        ros::PoseStamped{{start_ns + after_ns, "world"}, ros::to_pose(pose_at(0.1 * i))});
  }
  const auto entries = read().entries;
  ASSERT_TRUE(entries[1].pose && entries[1].pose->heading_rad);
  EXPECT_NEAR(entries[1].pose->x_m, pose_at(0.5).x_m, 1e-12);
  EXPECT_NEAR(*entries[1].pose->heading_rad, pose_at(0.5).heading_rad, 1e-12);
}

TEST(RecordedTopicsLimit, MorePicturesThanAMillionAreRefused) {
  const auto recorded = std::make_shared<RecordedMessages>(MessageEncoding::cdr);
  for (int i = 0; i <= 1'000'000; ++i) recorded->add("/camera", i, ros::CompressedImage{});
  EXPECT_EQ(message_of<FileError>([&] { (void)read_recording(recorded, "drive.bag", sphere); }),
            "drive.bag: has more than 1000000 images; allowed: as many");
}

TEST_P(RecordedTopics, PosesOfOneTopicAreATrajectoryInSpace) {
  const auto poses = [&](const std::optional<std::string>& topic = {}) {
    return read_recorded_poses(*recorded_, "drive.bag", topic);
  };
  const auto refusal = [&](const std::optional<std::string>& topic = {}) {
    return message_of<FileError>([&] { (void)poses(topic); });
  };
  add_picture(0);
  EXPECT_TRUE(contains(refusal(), "drive.bag: has no topic with poses"));
  for (int i = 0; i < 3; ++i) add_odometry(i * 100 * ms);
  EXPECT_EQ(poses().format, "topic /odom (nav_msgs/Odometry)");
  ros::TransformStamped vicon;
  vicon.header = {start_ns + 50 * ms, "world"};
  vicon.child_frame_id = "robot";
  vicon.transform = {{1.0, 2.0, 3.0}, {0.5, 0.5, 0.5, 0.5}};
  recorded_->add("/vicon", start_ns, vicon);
  ros::PoseStamped pose;
  pose.header = vicon.header;
  pose.pose = vicon.transform;
  recorded_->add("/pose", start_ns, pose);
  EXPECT_EQ(refusal(), "drive.bag: has poses of several topics: /odom, /vicon, /pose; choose one");
  EXPECT_EQ(
      refusal("/camera"),
      "drive.bag: has no poses on topic /camera; its topics with poses: /odom, /vicon, /pose");
  const auto odometry = poses("/odom").poses;
  ASSERT_EQ(odometry.size(), 3U);
  EXPECT_NEAR(odometry[1].stamp_s, 1.7e9 + 0.1, 3e-7);  // of the header, not of the recording
  EXPECT_NEAR(to_pose2(odometry[1].pose).x_m, pose_at(0.1).x_m, 1e-12);
  EXPECT_NEAR(to_pose2(odometry[1].pose).heading_rad, pose_at(0.1).heading_rad, 1e-12);
  const Pose3 expected{{1.0, 2.0, 3.0}, {0.5, 0.5, 0.5, 0.5}};
  EXPECT_EQ(poses("/vicon").poses.at(0).pose, expected);
  EXPECT_EQ(poses("/pose").poses.at(0).pose, expected);
  pose.header.stamp_ns -= 5000 * ms;
  recorded_->add("/pose", start_ns + 100 * ms, pose);
  EXPECT_TRUE(contains(refusal("/pose"),
                       "drive.bag: topic /pose: the clock goes back at message 2; allowed: one "
                       "run; panonav convert drive.bag OUT.mcap joins the runs"));
}

TEST_P(RecordedTopics, GroundTruthIsNotOdometry) {
  const auto truth = [&](const std::optional<std::string>& topic = {}) {
    return read_recorded_poses(*recorded_, "drive.bag", topic, PoseUse::ground_truth);
  };
  for (int i = 0; i < 3; ++i) add_odometry(i * 100 * ms);
  EXPECT_EQ(message_of<FileError>([&] { (void)truth(); }),
            "drive.bag: has no ground truth, but odometry: /odom; to compare with odometry, choose "
            "one");
  EXPECT_TRUE(truth("/odom").is_estimate);
  recorded_->add("/clicked_point", start_ns, ros::PointStamped{{start_ns, "map"}, {9, 9, 0}});
  for (int i = 0; i < 3; ++i) {
    const std::int64_t ns = start_ns + i * 100 * ms;
    recorded_->add("/ground_truth", ns, ros::PointStamped{{ns, "world"}, {1.0 + i, 2.0, 3.0}});
  }
  const TrajectoryFile points = truth();
  EXPECT_EQ(points.format, "topic /ground_truth (geometry_msgs/PointStamped)");
  EXPECT_FALSE(points.has_rotations);
  EXPECT_FALSE(points.is_estimate);
  ASSERT_EQ(points.poses.size(), 3U);
  EXPECT_EQ(points.poses[2].pose, (Pose3{{3.0, 2.0, 3.0}, {}}));
  EXPECT_EQ(read_recorded_poses(*recorded_, "drive.bag", {}).format,
            "topic /odom (nav_msgs/Odometry)");
}

TEST_P(RecordedTopics, TransformsGivePosesInTheMap) {
  const auto poses = [&](PoseUse use) {
    return read_recorded_poses(*recorded_, "drive.bag", {}, use);
  };
  for (int i = 0; i <= 20; ++i) {
    add_transform("/tf", "odom", "base_link", i * 100 * ms, pose_at(0.1 * i));
  }
  EXPECT_EQ(poses(PoseUse::estimate).format, "transforms odom -> base_link");
  EXPECT_EQ(
      message_of<FileError>([&] { (void)poses(PoseUse::ground_truth); }),
      "drive.bag: the transforms of base_link begin at odom, and none leads to it from map or "
      "world (missing: map -> odom); it has: odom -> base_link");
  const Pose2 map_from_odom{10.0, -3.0, 0.5};
  for (int i = 0; i <= 4; ++i) {
    add_transform("/tf", "/map", "odom", i * 500 * ms + 30 * ms, map_from_odom);
  }
  add_transform("/tf_static", "base_link", "camera", 0, {0.1, 0.0, 0.0});
  const TrajectoryFile found = poses(PoseUse::ground_truth);
  EXPECT_EQ(found.format, "transforms map -> base_link");
  EXPECT_TRUE(found.is_estimate);
  EXPECT_EQ(found.poses.size(), 21U);
  for (std::size_t i = 0; i < found.poses.size(); ++i) {
    const Pose2 expected = map_from_odom * pose_at(0.1 * static_cast<double>(i));
    const Pose2 pose = to_pose2(found.poses[i].pose);
    EXPECT_NEAR(found.poses[i].stamp_s, 1.7e9 + 0.1 * static_cast<double>(i), 1e-6);
    EXPECT_NEAR(pose.x_m, expected.x_m, 1e-9);
    EXPECT_NEAR(pose.y_m, expected.y_m, 1e-9);
    EXPECT_NEAR(angle_difference(pose.heading_rad, expected.heading_rad), 0.0, 1e-9);
  }
}

TEST_P(RecordedTopics, TransformsOfACameraWithoutRobotGiveItsPoses) {
  add_picture(0);  // its frame is "camera"
  for (int i = 0; i < 3; ++i) add_transform("/tf", "world", "rig", i * 100 * ms, pose_at(0.1 * i));
  const auto poses = [&] {
    return read_recorded_poses(*recorded_, "drive.bag", "/tf", PoseUse::ground_truth);
  };
  EXPECT_EQ(message_of<FileError>([&] { (void)poses(); }),
            "drive.bag: no transform leads to base_link or base_footprint or camera; it has: world "
            "-> rig");
  add_transform("/tf_static", "rig", "camera", 0, {0.0, 0.0, 0.25});
  EXPECT_EQ(poses().format, "transforms world -> camera");
  EXPECT_EQ(poses().poses.size(), 3U);
}

}  // namespace
}  // namespace panonav::recordings
