#include "panonav_ros2/sensor_topics.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav::ros2 {

SensorTopics::SensorTopics(Participant& participant, const LocalisationNodeOptions& options,
                           const FrameNames& frames, WarningLog& log, RobotMotion& motion,
                           WorkQueue& queue)
    : participant_(participant),
      options_(options),
      frames_(frames),
      log_(log),
      motion_(motion),
      queue_(queue) {
  constexpr int sensor_depth = 50;
  const auto receive_message = [this](const auto& message) { receive(message); };
  if (options.use_sim_time) {
    subscribe<recordings::ros::Clock>(
        participant, log, "/clock", {.depth = 10, .reliable = false},
        [this](const recordings::ros::Clock& clock) { simulated_time_ns_ = clock.clock_ns; });
  }
  if (options.motion == MotionInput::odometry) {
    subscribe<recordings::ros::Odometry>(participant, log, "odom", {.depth = sensor_depth},
                                         receive_message);
  } else {
    subscribe<recordings::ros::TFMessage>(participant, log, "/tf", {.depth = 100}, receive_message);
    subscribe<recordings::ros::TFMessage>(participant, log, "/tf_static",
                                          {.depth = 100, .transient_local = true}, receive_message);
  }
  if (options.tilt_from_imu)
    subscribe<recordings::ros::Imu>(participant, log, "imu", {.depth = sensor_depth},
                                    receive_message);
  const auto receive_bytes = [this](const auto& message, std::span<const std::uint8_t> cdr) {
    receive_picture(message.header.stamp_ns, cdr);
  };
  if (options.pictures == PictureInput::raw) {
    subscribe<recordings::ros::Image>(participant, log, picture_topic(), {}, receive_bytes);
  } else {
    subscribe<recordings::ros::CompressedImage>(participant, log, picture_topic(), {},
                                                receive_bytes);
  }
}

std::int64_t SensorTopics::now_ns() const {
  if (options_.use_sim_time) return simulated_time_ns_;
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::string SensorTopics::picture_topic() const {
  return options_.pictures == PictureInput::raw ? "image" : "image/compressed";
}

std::string SensorTopics::motion_source() const {
  if (options_.motion == MotionInput::odometry) return "topic odom";
  return "TF from " + frames_.odom + " to " + frames_.base;
}

void SensorTopics::check_publishers() const {
  for (const std::string& topic : {picture_topic(), std::string("odom")}) {
    const std::size_t publishers = participant_.publishers(topic);
    if (publishers < 2) continue;
    log_.warn("publishers of " + topic, topic + " has " + std::to_string(publishers) +
                                            " publishers; one is expected, all are used");
  }
}

std::tuple<Observation, std::int64_t, std::string> SensorTopics::decode(
    std::span<const std::uint8_t> message) const {
  const auto named = [this](Image picture, const recordings::ros::Header& header) {
    Observation observation(std::move(picture));
    observation.name = picture_topic();
    return std::tuple(std::move(observation), header.stamp_ns, header.frame_id);
  };
  if (options_.pictures == PictureInput::raw) {
    const auto read = recordings::ros::read_message<recordings::ros::Image>(
        message, recordings::MessageEncoding::cdr);
    return named(recordings::ros::to_image(read), read.header);
  }
  const auto read = recordings::ros::read_message<recordings::ros::CompressedImage>(
      message, recordings::MessageEncoding::cdr);
  return named(recordings::ros::to_image(read, picture_topic()), read.header);
}

void SensorTopics::receive(const recordings::ros::Odometry& odometry) {
  require_frame("odom", odometry.header.frame_id, frames_.odom);
  require_frame("odom", odometry.child_frame_id, frames_.base);
  add_motion("odom", odometry.header.stamp_ns, odometry.pose.pose);
}

void SensorTopics::receive(const recordings::ros::TFMessage& message) {
  std::optional<std::int64_t> stamp_ns;
  for (const recordings::ros::TransformStamped& each : message.transforms) {
    if (each.child_frame_id == frames_.odom) continue;  // published by this node itself
    tree_.set(each);
    if (each.header.stamp_ns > 0) stamp_ns = std::max(stamp_ns.value_or(0), each.header.stamp_ns);
  }
  const auto odom_from_base = tree_.lookup(frames_.odom, frames_.base);
  if (!odom_from_base || !stamp_ns) return;
  // Skip messages without a newer stamp: other transforms, for example of wheels, contain no new
  // motion of the base.
  if (std::exchange(has_transform_, true) && *stamp_ns <= motion_.newest_ns()) return;
  add_motion("/tf", *stamp_ns, *odom_from_base);
}

void SensorTopics::receive(const recordings::ros::Imu& imu) {
  if (imu.orientation_covariance[0] == -1.0) {
    throw ContractError("orientation_covariance[0]", -1.0,
                        "another value: the sensor must state an orientation");
  }
  const Tilt tilt = recordings::ros::to_tilt(imu.orientation);
  if (!std::isfinite(tilt.roll_rad) || !std::isfinite(tilt.pitch_rad)) {
    throw ContractError("orientation", "not finite", "a unit quaternion");
  }
  motion_.set_tilt(tilt);
}

void SensorTopics::receive_picture(std::int64_t stamp_ns, std::span<const std::uint8_t> cdr) {
  if (last_picture_ns_ && stamp_ns <= *last_picture_ns_ &&
      stamp_ns > *last_picture_ns_ - MotionHistory::max_late_ns) {
    log_.warn("order of images",
              picture_topic() + ": a stamp is not after the one before it; the image is left out");
    return;
  }
  last_picture_ns_ = stamp_ns;
  queue_.set_picture(cdr);
}

void SensorTopics::add_motion(const std::string& topic, std::int64_t stamp_ns,
                              const recordings::ros::Pose& pose) {
  const MotionHistory::Added added = motion_.add(stamp_ns, recordings::ros::to_pose2(pose));
  if (added == MotionHistory::Added::late) {
    log_.warn("order of " + topic,
              topic + ": a stamp is not after the one before it; the message is left out");
  } else if (added == MotionHistory::Added::restarted) {
    log_.warn("start of " + topic,
              topic + ": the motion begins again, elsewhere or at an earlier time");
  }
}

}  // namespace panonav::ros2
