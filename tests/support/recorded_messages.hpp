#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "panonav_recordings/recording.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::testing {

/// A recording in memory.
class RecordedMessages : public recordings::Recording {
 public:
  explicit RecordedMessages(recordings::MessageEncoding encoding) : encoding_(encoding) {}

  template <class Message>
  void add(const std::string& topic, std::int64_t log_ns, const Message& message) {
    add(topic, Message::type, log_ns, recordings::ros::write_message(message, encoding_));
  }
  void add(const std::string& topic, std::string_view type, std::int64_t log_ns,
           std::vector<std::uint8_t> bytes) {
    auto found = std::ranges::find_if(
        topics_, [&](const auto& each) { return each.name == topic && each.type == type; });
    if (found == topics_.end()) {
      topics_.push_back({topic, std::string(type), encoding_, 0});
      found = topics_.end() - 1;
    }
    ++found->messages;
    recordings::MessageLocation location;
    location.time_ns = log_ns;
    location.topic = static_cast<std::uint32_t>(found - topics_.begin());
    location.offset = messages_.size();
    locations_.push_back(location);
    messages_.push_back(std::move(bytes));
  }

  [[nodiscard]] const std::vector<recordings::RecordedTopic>& topics() const noexcept override {
    return topics_;
  }
  [[nodiscard]] std::optional<recordings::TimeSpan> time() const noexcept override {
    return std::nullopt;
  }
  [[nodiscard]] std::vector<std::string> warnings() const override { return {}; }
  [[nodiscard]] std::vector<recordings::MessageLocation> locations(
      std::span<const std::uint32_t> topics,
      std::optional<recordings::TimeSpan> /*within*/) const override {
    std::vector<recordings::MessageLocation> found;
    for (const auto& location : locations_) {
      if (std::ranges::find(topics, location.topic) != topics.end()) found.push_back(location);
    }
    std::ranges::stable_sort(found, {}, &recordings::MessageLocation::time_ns);
    return found;
  }
  [[nodiscard]] std::vector<std::uint8_t> read(
      const recordings::MessageLocation& location) const override {
    return messages_.at(location.offset);
  }
  void for_each(std::span<const std::uint32_t> topics, std::optional<recordings::TimeSpan> within,
                const std::function<void(const recordings::MessageLocation&,
                                         std::span<const std::uint8_t>)>& use) const override {
    for (const auto& location : locations(topics, within))
      use(location, messages_.at(location.offset));
  }

 private:
  recordings::MessageEncoding encoding_;
  std::vector<recordings::RecordedTopic> topics_;
  std::vector<recordings::MessageLocation> locations_;
  std::vector<std::vector<std::uint8_t>> messages_;
};

/// Returns type and number of messages of each topic of a file without warnings.
inline std::map<std::string, std::pair<std::string, std::uint64_t>> topics_of(
    const std::string& file) {
  std::map<std::string, std::pair<std::string, std::uint64_t>> topics;
  const auto recording = panonav::recordings::Recording::open(file);
  EXPECT_TRUE(recording->warnings().empty());
  for (const auto& topic : recording->topics()) {
    topics[topic.name] = {topic.type, topic.messages};
  }
  return topics;
}

/// `use` gets each message of a topic, as CDR, which must be of the type.
template <class Message, class Use>
void for_each_message(const std::string& file, const std::string& topic, const Use& use) {
  const auto recording = panonav::recordings::Recording::open(file);
  for (std::uint32_t i = 0; i < recording->topics().size(); ++i) {
    if (recording->topics()[i].name != topic) continue;
    EXPECT_EQ(recording->topics()[i].type, Message::type);
    recording->for_each(
        std::array{i}, {},
        [&](const recordings::MessageLocation&, std::span<const std::uint8_t> bytes) {
          use(recordings::ros::read_message<Message>(bytes, recordings::MessageEncoding::cdr));
        });
  }
}

/// Expects what every record of a run of `count` pictures with true poses and one for each has:
/// types and numbers of the messages, stamps that ascend, and a path to which each pose is added.
inline void expect_record(
    const std::string& file, std::size_t count,
    const std::map<std::string, std::pair<std::string, std::uint64_t>>& more) {
  auto topics = topics_of(file);
  std::map<std::string, std::pair<std::string, std::uint64_t>> expected{
      {"/camera/image/compressed", {"sensor_msgs/CompressedImage", count}},
      {"/panorama/compressed", {"sensor_msgs/CompressedImage", count}},
      {"/tf", {"tf2_msgs/TFMessage", count}},
      {"/pose", {"geometry_msgs/PoseWithCovarianceStamped", count}},
      {"/path", {"nav_msgs/Path", count}},
      {"/path/points", {"sensor_msgs/PointCloud2", count}}};
  expected.insert(more.begin(), more.end());
  EXPECT_EQ(topics, expected) << file;
  std::int64_t before_ns = -1;
  std::size_t poses = 0;
  for_each_message<recordings::ros::Path>(file, "/path", [&](const recordings::ros::Path& path) {
    EXPECT_GT(path.header.stamp_ns, before_ns);
    before_ns = path.header.stamp_ns;
    EXPECT_EQ(path.poses.size(), ++poses);
    EXPECT_EQ(path.poses.back().header.stamp_ns, path.header.stamp_ns);
  });
  EXPECT_EQ(poses, count);
}

}  // namespace panonav::testing
