#include "panonav_recordings/recorded_poses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/position_bound.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

namespace {

constexpr std::array<std::string_view, 4> pose_types{ros::Odometry::type, ros::PoseStamped::type,
                                                     ros::PoseWithCovarianceStamped::type,
                                                     ros::TransformStamped::type};

/// A pose with its time of recording and the stamp of its header.
struct TimedPose {
  std::int64_t log_ns = 0;
  std::int64_t stamp_ns = 0;
  ros::Pose pose;
};

bool has_poses(const RecordedTopic& topic) {
  return topic.encoding != MessageEncoding::other && topic.messages > 0 &&
         std::ranges::find(pose_types, topic.type) != pose_types.end();
}

std::string list_pose_topics(const std::vector<RecordedTopic>& topics) {
  std::string text;
  for (const RecordedTopic& topic : topics) {
    if (has_poses(topic)) text += (text.empty() ? "" : ", ") + to_readable_line(topic.name);
  }
  return text.empty() ? "none" : text;
}

std::uint32_t choose_topic(const std::filesystem::path& path,
                           const std::vector<RecordedTopic>& topics,
                           const std::optional<std::string>& name) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < topics.size(); ++i) {
    if (has_poses(topics[i]) && (!name || topics[i].name == *name)) found.push_back(i);
  }
  if (found.size() == 1) return found.front();
  if (name) {
    throw FileError(path.string(), "has no poses on topic " + to_readable_line(*name) +
                                       "; its topics with poses: " + list_pose_topics(topics));
  }
  if (found.empty()) {
    throw FileError(path.string(),
                    "has no topic with poses; allowed: Odometry, PoseStamped, "
                    "PoseWithCovarianceStamped or TransformStamped");
  }
  throw FileError(path.string(),
                  "has poses of several topics: " + list_pose_topics(topics) + "; choose one");
}

template <class Message>
TimedPose read_pose_as(std::span<const std::uint8_t> bytes, MessageEncoding encoding) {
  const auto message = ros::read_message<Message>(bytes, encoding);
  if constexpr (std::is_same_v<Message, ros::TransformStamped>) {
    return {0, message.header.stamp_ns, message.transform};
  } else if constexpr (std::is_same_v<Message, ros::PoseStamped>) {
    return {0, message.header.stamp_ns, message.pose};
  } else {
    return {0, message.header.stamp_ns, message.pose.pose};
  }
}

TimedPose read_pose(const RecordedTopic& topic, std::span<const std::uint8_t> bytes) {
  if (topic.type == ros::Odometry::type) return read_pose_as<ros::Odometry>(bytes, topic.encoding);
  if (topic.type == ros::PoseStamped::type) {
    return read_pose_as<ros::PoseStamped>(bytes, topic.encoding);
  }
  if (topic.type == ros::TransformStamped::type) {
    return read_pose_as<ros::TransformStamped>(bytes, topic.encoding);
  }
  return read_pose_as<ros::PoseWithCovarianceStamped>(bytes, topic.encoding);
}

Pose3 to_pose3(const ros::Pose& pose) {
  const auto& [x, y, z, w] = pose.orientation;
  const double length = std::sqrt(x * x + y * y + z * z + w * w);
  return {{pose.position.x, pose.position.y, pose.position.z},
          {w / length, x / length, y / length, z / length}};
}

/// Throws FileError if the stamps go back, as sorted poses of two runs would be mixed. Messages
/// that overtook others by a second are no second run.
template <class TimeOf>
void require_one_run(const std::vector<TimedPose>& timed, const TimeOf& time_of,
                     const std::filesystem::path& path, const std::string& topic) {
  constexpr std::int64_t max_step_back_ns = 1'000'000'000;
  for (std::size_t i = 1; i < timed.size(); ++i) {
    if (time_of(timed[i - 1]) - time_of(timed[i]) <= max_step_back_ns) continue;
    throw FileError(path.string(), "topic " + topic + ": the clock goes back at message " +
                                       std::to_string(i + 1) +
                                       "; allowed: one run; cut the recording there");
  }
}

}  // namespace

TrajectoryFile read_recorded_poses(const std::filesystem::path& path,
                                   const std::optional<std::string>& topic) {
  return read_recorded_poses(*Recording::open(path), path, topic);
}

TrajectoryFile read_recorded_poses(const Recording& recording, const std::filesystem::path& path,
                                   const std::optional<std::string>& topic) {
  constexpr double second_ns = 1e9;
  constexpr std::size_t max_poses = 10'000'000;  // 80 bytes each, against hostile recordings
  const std::uint32_t index = choose_topic(path, recording.topics(), topic);
  const RecordedTopic& chosen = recording.topics()[index];
  const std::string name = to_readable_line(chosen.name);
  std::vector<TimedPose> timed;
  recording.for_each(
      std::array{index}, {},
      [&](const MessageLocation& location, std::span<const std::uint8_t> bytes) {
        try {
          timed.push_back(read_pose(chosen, bytes));
        } catch (const ContractError& error) {
          throw FileError(path.string(), "topic " + name + ": " + error.what());
        }
        const auto& [x, y, z] = timed.back().pose.position;
        if (!is_position(x) || !is_position(y) || !is_position(z) || timed.size() > max_poses) {
          throw FileError(path.string(), "topic " + name +
                                             ": a position is out of range, or there "
                                             "are more than 10000000 poses; allowed: " +
                                             std::string(position_range));
        }
        timed.back().log_ns = location.time_ns;
      });
  const bool has_stamps =
      std::ranges::any_of(timed, [](const TimedPose& each) { return each.stamp_ns != 0; });
  const auto time_of = [has_stamps](const TimedPose& each) {
    return has_stamps ? each.stamp_ns : each.log_ns;
  };
  require_one_run(timed, time_of, path, name);
  std::ranges::stable_sort(timed, {}, time_of);
  TrajectoryFile file{.format = "topic " + name + " (" + chosen.type + ")", .poses = {}};
  for (const TimedPose& each : timed) {
    const StampedPose3 pose{static_cast<double>(time_of(each)) / second_ns, to_pose3(each.pose)};
    if (!file.poses.empty() && pose.stamp_s <= file.poses.back().stamp_s) {
      ++file.repeated;
    } else {
      file.poses.push_back(pose);
    }
  }
  if (file.poses.empty()) {
    throw FileError(path.string(), "topic " + name + " contains no pose; allowed: one or more");
  }
  return file;
}

}  // namespace panonav::recordings
