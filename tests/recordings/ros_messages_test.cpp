// Messages of ROS, against bytes that other programs wrote: tests/fuzz/corpus/ros_messages holds,
// after a byte that chooses type and encoding, what @foxglove/rosmsg-serialization,
// rosmsg2-serialization and cdr (npm) make of the values below.
#include "panonav_recordings/ros_messages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <numeric>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "support/picture_samples.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::recordings {
using namespace testing;
namespace {

namespace fs = std::filesystem;
using Blob = std::vector<std::uint8_t>;

constexpr std::int64_t second_ns = 1'000'000'000;
constexpr std::int64_t stamp_ns = 1'700'000'000 * second_ns + 123456789;

Blob bytes_from(const std::vector<int>& values) {
  Blob bytes;
  for (const int value : values) bytes.push_back(static_cast<std::uint8_t>(value));
  return bytes;
}

Blob golden_message(const std::string& name) {
  const std::string file =
      bytes_of(fs::path(PANONAV_TEST_DATA) / "../../fuzz/corpus/ros_messages" / name);
  const auto* begin = reinterpret_cast<const std::uint8_t*>(file.data());
  return {begin + 1, begin + file.size()};
}

template <std::size_t count>
std::array<double, count> counting_from(double first) {
  std::array<double, count> numbers;
  std::iota(numbers.begin(), numbers.end(), first);
  return numbers;
}

ros::Header header(const std::string& frame, std::int64_t ns = stamp_ns) {
  return {ns, frame};
}

ros::Pose pose(double k) {
  return {{1.5 + k, -2.25, 0.125}, {0.0, 0.0, 0.6, 0.8}};
}

/// The bytes are those of the message, and what is read from them is written as the same bytes.
template <class Message>
void expect_golden(const Message& message) {
  const std::string type(Message::type);
  const std::string name = type.substr(type.find('/') + 1);
  for (const auto& [encoding, end] :
       {std::pair{MessageEncoding::ros1, "_ros1"}, std::pair{MessageEncoding::cdr, "_cdr"}}) {
    SCOPED_TRACE(name + end);
    const Blob bytes = golden_message(name + end);
    ASSERT_GT(bytes.size(), 20U);
    EXPECT_EQ(ros::write_message(message, encoding), bytes);
    EXPECT_EQ(ros::write_message(ros::read_message<Message>(bytes, encoding), encoding), bytes);
    for (std::size_t kept = 0; kept < bytes.size(); ++kept) {
      EXPECT_THROW((void)ros::read_message<Message>(std::span(bytes).first(kept), encoding),
                   ContractError)
          << kept;
    }
    Blob longer = bytes;
    longer.resize(bytes.size() + 4);
    EXPECT_THROW((void)ros::read_message<Message>(longer, encoding), ContractError);
  }
}

TEST(RosMessages, AreTheBytesThatOthersWrite) {
  const Blob data = bytes_from({1, 2, 3, 4, 5, 6, 7, 8, 9, 10});
  Blob tens;
  for (int i = 0; i < 20; ++i) tens.push_back(static_cast<std::uint8_t>(10 * i));
  expect_golden(ros::Image{header("camera"), 2, 3, "bgr8", 0, 10, tens});
  const Blob jpeg = bytes_from({255, 216, 255, 0, 7});
  expect_golden(ros::CompressedImage{header("cam"), "rgb8; jpeg compressed bgr8", jpeg});
  expect_golden(ros::Imu{header("imu_link"),
                         {0.1, 0.1, 0.7, 0.7},
                         counting_from<9>(0.5),
                         {0.01, 0.02, -0.03},
                         counting_from<9>(10),
                         {0.5, -0.25, 9.81},
                         counting_from<9>(20)});
  expect_golden(ros::PointCloud2{
      header("map"), 1, 2, {{"x", 0, 7, 1}, {"intensity", 4, 2, 1}}, 0, 5, 10, data, 1});
  expect_golden(ros::Odometry{header("odom"),
                              "base_link",
                              {pose(0), counting_from<36>(0)},
                              {0.5, 0, 0.25},
                              {0, 0.125, -0.3},
                              counting_from<36>(100)});
  constexpr std::int64_t whole = 1'700'000'000 * second_ns;
  expect_golden(ros::Path{header("map"),
                          {{header("m", whole), pose(0)}, {header("map", whole + 1), pose(1)}}});
  expect_golden(
      ros::OccupancyGrid{header("map"), whole + 5, 0.05F, 3, 2, pose(0), {-1, 0, 100, 50, -1, 7}});
  constexpr float infinity = std::numeric_limits<float>::infinity();
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  expect_golden(ros::LaserScan{
      header("camera"), -1.5F, 1.5F, 1.5F, 0, 0.125F, 0.25F, 2.5F, {0.5F, infinity, unknown}, {}});
  expect_golden(ros::TFMessage{{{header("odom", whole), "base_footprint", pose(0)},
                                {header("base_footprint", whole + 1), "base", pose(1)}}});
  expect_golden(ros::PointStamped{header("world"), {3, 4.5, -0.5}});
  expect_golden(ros::PoseStamped{header("world"), pose(2)});
  expect_golden(ros::PoseWithCovarianceStamped{header("map"), {pose(0), counting_from<36>(-3)}});
  expect_golden(ros::PoseArray{header("map"), {pose(0), pose(1), pose(2)}});
  expect_golden(ros::DiagnosticArray{
      header(""),
      {{1, "panonav", "lost", "", {{"ess", "12.5"}, {"k", ""}}}, {0, "camera", "", "c1", {}}}});
}

TEST(RosMessages, BigEndianCdrIsRead) {
  const auto big =
      ros::read_message<ros::Imu>(golden_message("Imu_big_endian"), MessageEncoding::cdr);
  EXPECT_EQ(ros::write_message(big), golden_message("Imu_cdr"));
}

TEST(RosMessages, WrongBytesGiveOneLine) {
  const auto read = [](Blob bytes, MessageEncoding encoding = MessageEncoding::cdr) {
    return message_of<ContractError>(
        [&] { (void)ros::read_message<ros::Odometry>(bytes, encoding); });
  };
  Blob bytes = golden_message("Odometry_cdr");
  bytes[1] = std::uint8_t{7};
  EXPECT_EQ(read(bytes),
            "nav_msgs/Odometry message: CDR representation is 7; allowed: 0 (big endian), 1 "
            "(little)");
  bytes = golden_message("Odometry_cdr");
  bytes[12] = std::uint8_t{0xFF};  // of the frame's length
  bytes[14] = std::uint8_t{0xFF};
  EXPECT_EQ(read(bytes),
            "nav_msgs/Odometry message: length is 724 bytes; allowed: room for all that it "
            "announces");
  EXPECT_EQ(read(bytes, MessageEncoding::other),
            "nav_msgs/Odometry message: encoding is other; allowed: ros1, cdr");
  ros::Odometry odometry{header("odom"), "base", {pose(0), {}}, {}, {}, {}};
  odometry.pose.pose.position.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(
      read(ros::write_message(odometry)),
      "nav_msgs/Odometry message: position is 1.5, nan, 0.125; allowed: -10000000 to 10000000 m");
  odometry.pose.pose = {{}, {0.0, 0.0, 0.0, 0.0}};
  EXPECT_EQ(read(ros::write_message(odometry)),
            "nav_msgs/Odometry message: length of a quaternion is 0; allowed: 1");
  ros::Imu imu{};
  imu.header.stamp_ns = (std::int64_t{1} << 31) * second_ns;
  EXPECT_EQ(message_of<ContractError>([&] { (void)ros::write_message(imu); }),
            "stamp is 2147483648 s; allowed: -2147483648 .. 2147483647 s");
  EXPECT_NO_THROW((void)ros::write_message(imu, MessageEncoding::ros1));
  imu.header.stamp_ns = -1;
  EXPECT_EQ(
      ros::read_message<ros::Imu>(ros::write_message(imu), MessageEncoding::cdr).header.stamp_ns,
      -1);
}

TEST(RosMessages, SchemaHoldsEveryTypeThatItNames) {
  EXPECT_EQ(
      ros::ros2_schema("geometry_msgs/PointStamped"),
      "std_msgs/Header header\ngeometry_msgs/Point point\n" + std::string(80, '=') +
          "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" +
          std::string(80, '=') + "\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n" +
          std::string(80, '=') + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n");
  EXPECT_THROW((void)ros::ros2_schema("std_msgs/Empty"), ContractError);
}

TEST(RosPoses, AgreeWithThePlane) {
  Random random(11);
  for (int i = 0; i < 50; ++i) {
    const Pose2 a{random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-3.1, 3.1)};
    const Pose2 b{random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-3.1, 3.1)};
    const auto expect_near = [](const Pose2& seen, const Pose2& expected) {
      EXPECT_NEAR(seen.x_m, expected.x_m, 1e-12);
      EXPECT_NEAR(seen.y_m, expected.y_m, 1e-12);
      EXPECT_NEAR(angle_difference(seen.heading_rad, expected.heading_rad), 0.0, 1e-12);
    };
    expect_near(ros::to_pose2(ros::to_pose(a)), a);
    expect_near(ros::to_pose2(ros::to_pose(a) * ros::to_pose(b)), a * b);
    expect_near(ros::to_pose2(ros::inverse(ros::to_pose(a))), inverse(a));
    const double share = random.uniform(0.0, 1.0);
    const double turn = angle_difference(b.heading_rad, a.heading_rad);
    expect_near(ros::to_pose2(ros::interpolate(ros::to_pose(a), ros::to_pose(b), share)),
                {std::lerp(a.x_m, b.x_m, share), std::lerp(a.y_m, b.y_m, share),
                 wrap_angle(a.heading_rad + share * turn)});
    const Tilt tilt{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)};
    const ros::Pose tilted = ros::to_pose(a, tilt);
    expect_near(ros::to_pose2(tilted), a);
    EXPECT_NEAR(ros::to_tilt(tilted.orientation).roll_rad, tilt.roll_rad, 1e-12);
    EXPECT_NEAR(ros::to_tilt(tilted.orientation).pitch_rad, tilt.pitch_rad, 1e-12);
  }
  // REP 103: positive pitch lowers the front, positive roll the right side.
  const ros::Pose front = ros::to_pose({}, {0.0, 0.3}) * ros::Pose{{1.0, 0.0, 0.0}, {}};
  EXPECT_NEAR(front.position.z, -std::sin(0.3), 1e-12);
  const ros::Pose right = ros::to_pose({}, {0.3, 0.0}) * ros::Pose{{0.0, -1.0, 0.0}, {}};
  EXPECT_NEAR(right.position.z, -std::sin(0.3), 1e-12);
}

ros::Image raw_image(const Blob& data, int width, int height, const std::string& encoding,
                     std::uint32_t step) {
  ros::Image message;
  message.width = static_cast<std::uint32_t>(width);
  message.height = static_cast<std::uint32_t>(height);
  message.encoding = encoding;
  message.step = step;
  message.data = data;
  return message;
}

Image pixels(int width, int height, int channels, std::vector<std::uint8_t> values) {
  return {width, height, channels, std::move(values)};
}

TEST(RosPictures, ChannelsComeInTheOrderOfTheirEncoding) {
  const Blob data = bytes_from({1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 9, 8, 7, 6, 5, 4, 3, 2, 0, 0});
  const auto read = [&](const std::string& encoding, int width) {
    return ros::to_image(raw_image(data, width, 2, encoding, 10));
  };
  EXPECT_EQ(read("mono8", 3), pixels(3, 2, 1, {1, 2, 3, 9, 8, 7}));
  EXPECT_EQ(read("8UC1", 3), read("mono8", 3));
  EXPECT_EQ(read("rgb8", 2), pixels(2, 2, 3, {1, 2, 3, 4, 5, 6, 9, 8, 7, 6, 5, 4}));
  EXPECT_EQ(read("bgr8", 2), pixels(2, 2, 3, {3, 2, 1, 6, 5, 4, 7, 8, 9, 4, 5, 6}));
  EXPECT_EQ(read("8UC3", 2), read("bgr8", 2));
  EXPECT_EQ(read("rgba8", 2), pixels(2, 2, 3, {1, 2, 3, 5, 6, 7, 9, 8, 7, 5, 4, 3}));
  EXPECT_EQ(read("bgra8", 2), pixels(2, 2, 3, {3, 2, 1, 7, 6, 5, 7, 8, 9, 3, 4, 5}));
  EXPECT_EQ(read("8UC4", 2), read("bgra8", 2));
}

TEST(RosPictures, DeepGreyIsScaledAsAPngIs) {
  std::vector<std::uint8_t> row;
  Blob little;
  Blob big;
  for (const int value : {0, 128, 129, 0x7FFF, 0x8000, 0xABCD, 0xFFFF}) {
    row.push_back(static_cast<std::uint8_t>(value >> 8));
    row.push_back(static_cast<std::uint8_t>(value & 255));
    big.push_back(static_cast<std::uint8_t>(value >> 8));
    big.push_back(static_cast<std::uint8_t>(value & 255));
    little.push_back(static_cast<std::uint8_t>(value & 255));
    little.push_back(static_cast<std::uint8_t>(value >> 8));
  }
  const Image as_png = decode_image(make_png(7, 1, PNG_COLOR_TYPE_GRAY, 16, {row}), "16");
  ros::Image message = raw_image(little, 7, 1, "mono16", 14);
  EXPECT_EQ(ros::to_image(message), as_png);
  message.data = big;
  message.is_bigendian = 1;
  EXPECT_EQ(ros::to_image(message), as_png);
}

TEST(RosPictures, BayerPatternsGiveAPlaneOfColoursBack) {
  // Each colour is linear in the position, so that bilinear interpolation is exact inside.
  constexpr int width = 8;
  constexpr int height = 6;
  Image plane(width, height, 3);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      plane.at(u, v, 0) = static_cast<std::uint8_t>(10 + 4 * u + 8 * v);
      plane.at(u, v, 1) = static_cast<std::uint8_t>(200 - 4 * u - 4 * v);
      plane.at(u, v, 2) = static_cast<std::uint8_t>(60 + 12 * u - 4 * v);
    }
  }
  for (const std::string pattern : {"rggb", "bggr", "gbrg", "grbg"}) {
    SCOPED_TRACE(pattern);
    Blob data;
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        const char colour = pattern[static_cast<std::size_t>(2 * (v % 2) + u % 2)];
        data.push_back(
            static_cast<std::uint8_t>(plane.at(u, v, colour == 'r' ? 0 : (colour == 'g' ? 1 : 2))));
      }
    }
    const Image seen =
        ros::to_image(raw_image(data, width, height, "bayer_" + pattern + "8", width));
    for (int v = 1; v + 1 < height; ++v) {
      for (int u = 1; u + 1 < width; ++u) {
        for (int c = 0; c < 3; ++c) ASSERT_EQ(seen.at(u, v, c), plane.at(u, v, c)) << u << " " << v;
      }
    }
    // Measured pixels stay, edges included.
    EXPECT_EQ(seen.at(0, 0, pattern[0] == 'r' ? 0 : (pattern[0] == 'g' ? 1 : 2)), data[0]);
  }
}

TEST(RosPictures, YuvGivesTheColoursOfBt601) {
  // Black, white; red of (255, 0, 0) is Y 81, U 90, V 240.
  const Blob uyvy = bytes_from({128, 16, 128, 235, 90, 81, 240, 81});
  const Blob yuyv = bytes_from({16, 128, 235, 128, 81, 90, 81, 240});
  const Image expected = ros::to_image(raw_image(uyvy, 4, 1, "yuv422", 8));
  EXPECT_EQ(ros::to_image(raw_image(yuyv, 4, 1, "yuv422_yuy2", 8)), expected);
  EXPECT_EQ(ros::to_image(raw_image(yuyv, 4, 1, "yuyv", 8)), expected);
  EXPECT_EQ(ros::to_image(raw_image(uyvy, 4, 1, "uyvy", 8)), expected);
  const std::vector<int> rgb{0, 0, 0, 255, 255, 255, 255, 0, 0, 255, 0, 0};
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    EXPECT_NEAR(expected.pixels()[i], rgb[i], 1) << i;
  }
}

TEST(RosPictures, NamesOfEncodingsMayBeInCapitalsAndHaveAliases) {
  const Blob yuyv = bytes_from({16, 128, 235, 90, 81, 90, 81, 240});
  const Image expected = ros::to_image(raw_image(yuyv, 4, 1, "yuv422_yuy2", 8));
  for (const char* name : {"YUYV", "YUY2", "yuy2", "YUV422_YUY2"})
    EXPECT_EQ(ros::to_image(raw_image(yuyv, 4, 1, name, 8)), expected) << name;
  const Blob yvyu = bytes_from({16, 90, 235, 128, 81, 240, 81, 90});
  EXPECT_EQ(ros::to_image(raw_image(yvyu, 4, 1, "YVYU", 8)), expected);
  const Blob uyvy = bytes_from({128, 16, 90, 235, 90, 81, 240, 81});
  EXPECT_EQ(ros::to_image(raw_image(uyvy, 4, 1, "UYVY", 8)), expected);
  const Blob grey = bytes_from({1, 2, 3, 4});
  EXPECT_EQ(ros::to_image(raw_image(grey, 4, 1, "MONO8", 4)),
            ros::to_image(raw_image(grey, 4, 1, "8UC1", 4)));
}

TEST(RosPictures, DeepPixelsAreScaledToBytes) {
  const Blob blue_first = bytes_from({0x34, 0x12, 0xFF, 0xFF, 0x00, 0x80});
  const Image bgr = ros::to_image(raw_image(blue_first, 1, 1, "bgr16", 6));
  ASSERT_EQ(bgr.channels(), 3);
  EXPECT_EQ((std::vector<std::uint8_t>(bgr.pixels().begin(), bgr.pixels().end())),
            (std::vector<std::uint8_t>{0x80, 0xFF, 0x12}));
  const Image rgb = ros::to_image(raw_image(blue_first, 1, 1, "rgb16", 6));
  EXPECT_EQ(rgb.at(0, 0, 0), 0x12);
  EXPECT_EQ(rgb.at(0, 0, 2), 0x80);
  EXPECT_EQ(ros::to_image(raw_image(blue_first, 3, 1, "16UC1", 6)),
            ros::to_image(raw_image(blue_first, 3, 1, "mono16", 6)));
  const auto floats = [](std::vector<float> values) {
    Blob bytes(4 * values.size());
    std::memcpy(bytes.data(), values.data(), bytes.size());
    return bytes;
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Blob unit = floats({0.0F, 0.5F, 1.0F, nan, -3.0F, 1.001F});
  const Image of_unit = ros::to_image(raw_image(unit, 6, 1, "32FC1", 24));
  EXPECT_EQ((std::vector<std::uint8_t>(of_unit.pixels().begin(), of_unit.pixels().end())),
            (std::vector<std::uint8_t>{0, 128, 255, 0, 0, 255}));
  const Blob bytes = floats({0.0F, 100.0F, 255.0F, 300.0F, 1.0F, nan});
  const Image of_bytes = ros::to_image(raw_image(bytes, 6, 1, "32FC1", 24));
  EXPECT_EQ((std::vector<std::uint8_t>(of_bytes.pixels().begin(), of_bytes.pixels().end())),
            (std::vector<std::uint8_t>{0, 100, 255, 255, 1, 0}));
}

TEST(RosPictures, PlanesOfYuvGiveThePixelsOfPackedYuv) {
  // 4 x 2 px with a padded row; two colours of 2 x 2 px.
  const Blob uyvy = bytes_from({90, 16, 240, 60, 100, 90, 50, 120,  //
                                90, 130, 240, 160, 100, 190, 50, 235});
  const Image expected = ros::to_image(raw_image(uyvy, 4, 2, "uyvy", 8));
  const std::vector<int> luma{16, 60, 90, 120, 0, 0, 130, 160, 190, 235, 0, 0};
  const auto with_luma = [&](std::vector<int> colours) {
    colours.insert(colours.begin(), luma.begin(), luma.end());
    return bytes_from(colours);
  };
  const std::vector<std::pair<std::string, Blob>> planes{
      {"nv12", with_luma({90, 240, 100, 50, 0, 0})},
      {"NV21", with_luma({240, 90, 50, 100, 0, 0})},
      {"i420", with_luma({90, 100, 0, 240, 50, 0})},
      {"yuv420p", with_luma({90, 100, 0, 240, 50, 0})},
      {"yv12", with_luma({240, 50, 0, 90, 100, 0})},
      {"nv24", with_luma({90, 240, 90, 240, 100, 50, 100, 50, 0, 0, 0, 0,  //
                          90, 240, 90, 240, 100, 50, 100, 50, 0, 0, 0, 0})}};
  for (const auto& [name, data] : planes) {
    SCOPED_TRACE(name);
    EXPECT_EQ(ros::to_image(raw_image(data, 4, 2, name, 6)), expected);
    // Some drivers count the rows of the colours.
    const auto rows = static_cast<std::uint32_t>(data.size() / 6);
    EXPECT_EQ(ros::to_image(raw_image(data, 4, rows, name, 6)), expected);
    const Blob cut(data.begin(), data.end() - 1);
    EXPECT_THROW((void)ros::to_image(raw_image(cut, 4, 2, name, 6)), ContractError);
  }
  EXPECT_THROW((void)ros::to_image(raw_image(planes[0].second, 3, 2, "nv12", 6)), ContractError);
}

TEST(RosPictures, WhatDoesNotFitIsOneLine) {
  const Blob data(24);
  const auto error = [&](const ros::Image& message, const ImageLimits& limits = {}) {
    return message_of<ContractError>([&] { (void)ros::to_image(message, limits); });
  };
  EXPECT_EQ(error(raw_image(data, 4, 2, "mono8", 12)), "no error");
  EXPECT_EQ(error(raw_image(data, 4, 2, "rgb8", 11)),
            "sensor_msgs/Image step is 11; allowed: at least 12 for 4 px of rgb8");
  EXPECT_EQ(error(raw_image(data, 4, 3, "rgb8", 12)),
            "sensor_msgs/Image data is 24 bytes; allowed: 36, height x step");
  EXPECT_EQ(error(raw_image(data, 3, 2, "yuv422", 12)),
            "sensor_msgs/Image width is 3; allowed: even for YUV 4:2:2");
  EXPECT_EQ(error(raw_image(data, 1, 24, "bayer_rggb8", 1)),
            "sensor_msgs/Image size is 1 x 24; allowed: 2 x 2 or more for a Bayer pattern");
  EXPECT_EQ(error(raw_image(data, 0, 2, "mono8", 12)),
            "sensor_msgs/Image size is 0 x 2; allowed: 1 .. 32768 px a side and at most 134217728 "
            "px in all");
  EXPECT_NE(error(raw_image(data, 6, 4, "mono8", 6), {.area_px = 23}), "no error");
  EXPECT_TRUE(error(raw_image(data, 4, 2, "64FC1", 32))
                  .starts_with("sensor_msgs/Image encoding is 64FC1; allowed: mono8, 8UC1"));
  // An area that overflows 32 bits is compared as what it is.
  ros::Image huge = raw_image(data, 4, 2, "mono8", 12);
  huge.height = 0xFFFFFFFF;
  huge.step = 0xFFFFFFFF;
  EXPECT_NE(error(huge), "no error");
}

TEST(RosPictures, CompressedOnesAreDecodedAsFilesAre) {
  Random random(3);
  const Image image = random_image(random, 9, 5, 3);
  const auto png = encode_png(image.view());
  ros::CompressedImage message;
  message.data = png;
  for (const char* format : {"png", "bgr8; png compressed bgr8", "jpeg", ""}) {
    message.format = format;
    EXPECT_EQ(ros::to_image(message, "topic"), image) << format;
  }
  for (const char* format : {"h264", "16UC1; compressedDepth png"}) {
    message.format = format;
    EXPECT_EQ(message_of<ContractError>([&] { (void)ros::to_image(message, "topic"); }),
              "sensor_msgs/CompressedImage format is " + std::string(format) +
                  "; allowed: jpeg, png, or such as 'rgb8; jpeg compressed bgr8'");
  }
  message.format = "jpeg";
  message.data = message.data.first(20);
  EXPECT_THROW((void)ros::to_image(message, "topic"), FileError);
}

}  // namespace
}  // namespace panonav::recordings
