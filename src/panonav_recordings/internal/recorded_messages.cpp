#include "panonav_recordings/internal/recorded_messages.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

namespace {

using MessageBytes = std::span<const std::uint8_t>;

/// Limits of memory against hostile recordings: 80 bytes for each message and 400 for each picture.
constexpr std::size_t max_samples = 10'000'000;
constexpr std::size_t max_pictures = 1'000'000;  // nine hours at 30 Hz

/// Sorts the messages of one pass into tracks.
class MessageCollector {
 public:
  MessageCollector(const std::filesystem::path& path, const Recording& recording,
                   const TopicChoice& choice)
      : path_(path), recording_(recording), choice_(choice) {
    if (choice.frames) made_.chain.emplace(choice.frames->first, choice.frames->second);
    made_.warnings = choice.warnings;
  }

  /// Adds a message; one that cannot be read is counted.
  void add(const MessageLocation& location, MessageBytes bytes) {
    try {
      add_by_role(location, bytes);
    } catch (const ContractError& error) {
      if (unreadable_++ == 0) first_error_ = error.what();
      return;
    }
    if (made_.pictures.size() > max_pictures) {
      throw FileError(path_.string(), "has more than " + std::to_string(max_pictures) +
                                          " images; allowed: as many");
    }
    if (samples_ > max_samples) {
      throw FileError(path_.string(), "has more than " + std::to_string(max_samples) +
                                          " messages of odometry, transforms and inertial sensors");
    }
  }

  [[nodiscard]] RecordedMessages finish() {
    if (unreadable_ > 0) {
      warn(std::to_string(unreadable_) +
           " messages cannot be read and are left out; the first: " + first_error_);
    }
    drop_chain_unless_connected();
    if (made_.pictures.empty()) {
      throw FileError(path_.string(), "none of its images can be read: " + first_error_);
    }
    return std::move(made_);
  }

 private:
  void warn(std::string line) { made_.warnings.push_back(std::move(line)); }

  void drop_chain_unless_connected() {
    auto& chain = made_.chain;
    if (!chain) return;
    if (chain->ignored_transform_count() > 0) {
      warn(std::to_string(chain->ignored_transform_count()) +
           " transforms give a frame another parent than before and are left out");
    }
    if (chain->is_connected()) return;
    if (choice_.frames_are_named) {
      const auto& [top, bottom] = *choice_.frames;
      throw FileError(path_.string(), "no transforms lead from " + to_readable_line(top) + " to " +
                                          to_readable_line(bottom) +
                                          "; it has: " + chain->list_transforms());
    }
    chain.reset();
  }

  void add_by_role(const MessageLocation& location, MessageBytes bytes) {
    switch (choice_.roles[location.topic]) {
      case TopicRole::none:
        break;
      case TopicRole::picture:
        add_picture(location, bytes);
        break;
      case TopicRole::odometry:
        add_odometry(location, bytes);
        break;
      case TopicRole::transforms:
        add_transforms(location, bytes);
        break;
      case TopicRole::tilt:
        add_orientation(location, bytes);
        break;
      case TopicRole::truth:
        add_truth(location, bytes);
        break;
    }
  }

  [[nodiscard]] const RecordedTopic& topic_of(const MessageLocation& location) const {
    return recording_.topics()[location.topic];
  }
  template <class Message>
  [[nodiscard]] Message read(const MessageLocation& location, MessageBytes bytes) const {
    return ros::read_message<Message>(bytes, topic_of(location).encoding);
  }

  void add_picture(const MessageLocation& location, MessageBytes bytes) {
    if (topic_of(location).type == ros::CompressedImage::type) {
      made_.pictures.push_back(
          {location, read<ros::CompressedImage>(location, bytes).header.stamp_ns});
      return;
    }
    const auto message = read<ros::Image>(location, bytes);
    const auto size = std::pair{message.width, message.height};
    if (made_.pictures.empty()) made_.first_size = size;
    if (made_.first_size != size) ++made_.differing_size_count;
    made_.pictures.push_back({location, message.header.stamp_ns});
  }

  void add_odometry(const MessageLocation& location, MessageBytes bytes) {
    const auto message = read<ros::Odometry>(location, bytes);
    made_.odometry.add({location.time_ns, message.header.stamp_ns}, message.pose.pose);
    ++samples_;
  }

  void add_transforms(const MessageLocation& location, MessageBytes bytes) {
    const bool is_static = topic_of(location).name.ends_with("tf_static");
    for (const auto& each : read<ros::TFMessage>(location, bytes).transforms) {
      made_.chain->add(each, location.time_ns, is_static);
      ++samples_;
    }
  }

  void add_orientation(const MessageLocation& location, MessageBytes bytes) {
    const auto message = read<ros::Imu>(location, bytes);
    const auto& [x, y, z, w] = message.orientation;
    const double length = std::sqrt(x * x + y * y + z * z + w * w);
    const bool is_stated = message.orientation_covariance[0] != -1.0 &&
                           std::abs(length - 1.0) <= ros::quaternion_tolerance;
    if (!is_stated) {
      ++made_.imu_without_orientation_count;
      return;
    }
    made_.orientation.add({location.time_ns, message.header.stamp_ns}, {{}, message.orientation});
    ++samples_;
  }

  void add_truth(const MessageLocation& location, MessageBytes bytes) {
    if (topic_of(location).type == ros::PoseStamped::type) {
      const auto message = read<ros::PoseStamped>(location, bytes);
      made_.truth.add({location.time_ns, message.header.stamp_ns}, message.pose);
    } else {
      const auto message = read<ros::PointStamped>(location, bytes);
      made_.truth_has_headings = false;
      made_.truth.add({location.time_ns, message.header.stamp_ns}, {message.point, {}});
    }
    ++samples_;
  }

  const std::filesystem::path& path_;
  const Recording& recording_;
  const TopicChoice& choice_;
  RecordedMessages made_;
  std::size_t samples_ = 0;  ///< stored poses and transforms; pictures are not included
  std::size_t unreadable_ = 0;
  std::string first_error_;
};

}  // namespace

bool RecordedMessages::sort() {
  const bool has_stamps =
      std::ranges::any_of(pictures, [](const RecordedPicture& each) { return each.stamp_ns != 0; });
  const bool use_log_times = !has_stamps || !odometry.has_stamps() || !orientation.has_stamps() ||
                             !truth.has_stamps() || (chain && !chain->has_stamps());
  if (use_log_times)
    warnings.emplace_back("headers without stamps: the times of recording are used instead");
  for (RecordedTrack* track : {&odometry, &orientation, &truth}) track->sort(use_log_times);
  if (chain) chain->sort(use_log_times);
  return use_log_times;
}

RecordedMessages collect_messages(const std::filesystem::path& path, const Recording& recording,
                                  const TopicChoice& choice) {
  MessageCollector collector(path, recording, choice);
  recording.for_each(choice.topics, {}, [&](const MessageLocation& location, MessageBytes bytes) {
    collector.add(location, bytes);
  });
  return collector.finish();
}

}  // namespace panonav::recordings
