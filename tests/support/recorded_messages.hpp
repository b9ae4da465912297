#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "panonav/io/recording.hpp"
#include "panonav/io/ros_messages.hpp"

namespace panonav::testing {

/// A recording in memory.
class RecordedMessages : public Recording {
 public:
  explicit RecordedMessages(MessageEncoding encoding) : encoding_(encoding) {}

  template <class Message>
  void add(const std::string& topic, std::int64_t log_ns, const Message& message) {
    add(topic, Message::type, log_ns, ros::write_message(message, encoding_));
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
    MessagePlace place;
    place.time_ns = log_ns;
    place.topic = static_cast<std::uint32_t>(found - topics_.begin());
    place.offset = messages_.size();
    places_.push_back(place);
    messages_.push_back(std::move(bytes));
  }

  [[nodiscard]] const std::vector<RecordedTopic>& topics() const noexcept override {
    return topics_;
  }
  [[nodiscard]] std::optional<TimeSpan> time() const noexcept override { return std::nullopt; }
  [[nodiscard]] std::vector<std::string> warnings() const override { return {}; }
  [[nodiscard]] std::vector<MessagePlace> places(
      std::span<const std::uint32_t> topics, std::optional<TimeSpan> /*within*/) const override {
    std::vector<MessagePlace> found;
    for (const auto& place : places_) {
      if (std::ranges::find(topics, place.topic) != topics.end()) found.push_back(place);
    }
    std::ranges::stable_sort(found, {}, &MessagePlace::time_ns);
    return found;
  }
  [[nodiscard]] std::vector<std::uint8_t> read(const MessagePlace& place) const override {
    return messages_.at(place.offset);
  }
  void for_each(std::span<const std::uint32_t> topics, std::optional<TimeSpan> within,
                const std::function<void(const MessagePlace&, std::span<const std::uint8_t>)>& use)
      const override {
    for (const auto& place : places(topics, within)) use(place, messages_.at(place.offset));
  }

 private:
  MessageEncoding encoding_;
  std::vector<RecordedTopic> topics_;
  std::vector<MessagePlace> places_;
  std::vector<std::vector<std::uint8_t>> messages_;
};

}  // namespace panonav::testing
