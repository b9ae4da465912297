#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/panorama/tilt.hpp"
#include "panonav_recordings/mcap_writer.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

/// Writes messages of one type to one topic of an MCAP file; adds its channel with the first
/// message.
template <class Message>
class TopicWriter {
 public:
  TopicWriter(McapWriter& writer, std::string topic) : writer_(&writer), name_(std::move(topic)) {}
  void write(std::int64_t log_ns, std::int64_t stamp_ns, const Message& message) {
    if (!channel_) {
      const std::string_view type = Message::type;
      channel_ = writer_->add_channel(
          name_, "cdr",
          writer_->add_schema(ros::ros2_type_name(type), "ros2msg", ros::ros2_schema(type)));
    }
    writer_->write(*channel_, log_ns, stamp_ns, ros::write_message(message));
  }

 private:
  McapWriter* writer_;
  std::string name_;
  std::optional<std::uint16_t> channel_;
};

/// Converts a stamp to nanoseconds. A stamp of whole microseconds stays exact: 1700000003.3 does
/// not become 1700000003.299999952.
inline std::int64_t to_nanoseconds(double stamp_s) {
  require(stamp_s >= 0.0 && stamp_s < 0x1p31, "stamp_s", stamp_s, "0 <= stamp_s < 2147483648");
  constexpr double second_ns = 1e9;
  const double whole = std::floor(stamp_s);
  const double rest_us = std::round((stamp_s - whole) * 1e6);
  const double rest_ns = std::round((stamp_s - whole) * second_ns);
  const bool is_whole_us = whole + rest_us / 1e6 == stamp_s;
  return std::llround(whole) * std::int64_t{1'000'000'000} +
         std::llround(is_whole_us ? 1e3 * rest_us : rest_ns);
}

/// Writes odometry, tilt and true pose of a robot on the topics where `read_recording` expects
/// them.
class RobotTopics {
 public:
  /// `world` is the name of the frame of true poses.
  RobotTopics(McapWriter& writer, std::string world)
      : world_(std::move(world)),
        odometry_(writer, "/odom"),
        imu_(writer, "/imu"),
        poses_(writer, "/ground_truth"),
        positions_(writer, "/ground_truth") {}

  void write(std::int64_t log_ns, std::int64_t ns, const std::optional<Pose2>& odometry,
             const std::optional<Tilt>& tilt, const std::optional<ReferencePose>& truth) {
    if (odometry) {
      odometry_.write(log_ns, ns,
                      {{ns, "odom"}, "base_link", {ros::to_pose(*odometry), {}}, {}, {}, {}});
    }
    if (tilt) {
      ros::Imu message;
      message.header = {ns, "base_link"};
      message.orientation = ros::to_pose({}, *tilt).orientation;
      message.angular_velocity_covariance[0] = -1.0;
      message.linear_acceleration_covariance[0] = -1.0;
      imu_.write(log_ns, ns, message);
    }
    if (truth && truth->heading_rad) {
      poses_.write(log_ns, ns,
                   {{ns, world_}, ros::to_pose({truth->x_m, truth->y_m, *truth->heading_rad})});
    } else if (truth) {
      positions_.write(log_ns, ns, {{ns, world_}, {truth->x_m, truth->y_m, 0.0}});
    }
  }

 private:
  std::string world_;
  TopicWriter<ros::Odometry> odometry_;
  TopicWriter<ros::Imu> imu_;
  TopicWriter<ros::PoseStamped> poses_;
  TopicWriter<ros::PointStamped> positions_;
};

}  // namespace panonav::recordings
