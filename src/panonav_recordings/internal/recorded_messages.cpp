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
  void add(const MessageLocation& place, MessageBytes bytes) {
    try {
      add_by_role(place, bytes);
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
    if (chain->other_parents() > 0) {
      warn(std::to_string(chain->other_parents()) +
           " transforms give a frame another parent than before and are left out");
    }
    if (chain->connected()) return;
    if (choice_.frames_are_named) {
      const auto& [top, bottom] = *choice_.frames;
      throw FileError(path_.string(), "no transforms lead from " + to_readable_line(top) + " to " +
                                          to_readable_line(bottom) + "; it has: " + chain->known());
    }
    chain.reset();
  }

  void add_by_role(const MessageLocation& place, MessageBytes bytes) {
    switch (choice_.roles[place.topic]) {
      case TopicRole::none:
        break;
      case TopicRole::picture:
        add_picture(place, bytes);
        break;
      case TopicRole::odometry:
        add_odometry(place, bytes);
        break;
      case TopicRole::transforms:
        add_transforms(place, bytes);
        break;
      case TopicRole::tilt:
        add_orientation(place, bytes);
        break;
      case TopicRole::truth:
        add_truth(place, bytes);
        break;
    }
  }

  [[nodiscard]] const RecordedTopic& topic_of(const MessageLocation& place) const {
    return recording_.topics()[place.topic];
  }
  template <class Message>
  [[nodiscard]] Message read(const MessageLocation& place, MessageBytes bytes) const {
    return ros::read_message<Message>(bytes, topic_of(place).encoding);
  }

  void add_picture(const MessageLocation& place, MessageBytes bytes) {
    if (topic_of(place).type == ros::CompressedImage::type) {
      made_.pictures.push_back({place, read<ros::CompressedImage>(place, bytes).header.stamp_ns});
      return;
    }
    const auto message = read<ros::Image>(place, bytes);
    const auto size = std::pair{message.width, message.height};
    if (made_.pictures.empty()) made_.first_size = size;
    if (made_.first_size != size) ++made_.other_sizes;
    made_.pictures.push_back({place, message.header.stamp_ns});
  }

  void add_odometry(const MessageLocation& place, MessageBytes bytes) {
    const auto message = read<ros::Odometry>(place, bytes);
    made_.odometry.add({place.time_ns, message.header.stamp_ns}, message.pose.pose);
    ++samples_;
  }

  void add_transforms(const MessageLocation& place, MessageBytes bytes) {
    const bool is_static = topic_of(place).name.ends_with("tf_static");
    for (const auto& each : read<ros::TFMessage>(place, bytes).transforms) {
      made_.chain->add(each, place.time_ns, is_static);
      ++samples_;
    }
  }

  void add_orientation(const MessageLocation& place, MessageBytes bytes) {
    const auto message = read<ros::Imu>(place, bytes);
    const auto& [x, y, z, w] = message.orientation;
    const double length = std::sqrt(x * x + y * y + z * z + w * w);
    const bool is_stated = message.orientation_covariance[0] != -1.0 &&
                           std::abs(length - 1.0) <= ros::quaternion_tolerance;
    if (!is_stated) {
      ++made_.without_orientation;
      return;
    }
    made_.orientation.add({place.time_ns, message.header.stamp_ns}, {{}, message.orientation});
    ++samples_;
  }

  void add_truth(const MessageLocation& place, MessageBytes bytes) {
    if (topic_of(place).type == ros::PoseStamped::type) {
      const auto message = read<ros::PoseStamped>(place, bytes);
      made_.truth.add({place.time_ns, message.header.stamp_ns}, message.pose);
    } else {
      const auto message = read<ros::PointStamped>(place, bytes);
      made_.truth_has_headings = false;
      made_.truth.add({place.time_ns, message.header.stamp_ns}, {message.point, {}});
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
  const bool by_log = !has_stamps || !odometry.has_stamps() || !orientation.has_stamps() ||
                      !truth.has_stamps() || (chain && !chain->has_stamps());
  if (by_log)
    warnings.emplace_back("headers without stamps: the times of recording are used instead");
  for (RecordedTrack* track : {&odometry, &orientation, &truth}) track->sort(by_log);
  if (chain) chain->sort(by_log);
  return by_log;
}

RecordedMessages collect_messages(const std::filesystem::path& path, const Recording& recording,
                                  const TopicChoice& choice) {
  MessageCollector collector(path, recording, choice);
  recording.for_each(choice.topics, {}, [&](const MessageLocation& place, MessageBytes bytes) {
    collector.add(place, bytes);
  });
  return collector.finish();
}

}  // namespace panonav::recordings
