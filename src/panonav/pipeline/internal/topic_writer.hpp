#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/io/mcap_writer.hpp"
#include "panonav/io/ros_messages.hpp"

namespace panonav {

/// Messages of one type on one topic of an MCAP file.
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

/// The stamp comes back as it was: the whole seconds are exact, and of the rest what a double
/// cannot hold is dropped, 1700000003.3 is no 1700000003.299999952.
inline std::int64_t nanoseconds(double stamp_s) {
  require(stamp_s >= 0.0 && stamp_s < 0x1p31, "stamp_s", stamp_s, "0 <= stamp_s < 2147483648");
  constexpr double second_ns = 1e9;
  const double whole = std::floor(stamp_s);
  const double rest_us = std::round((stamp_s - whole) * 1e6);
  const double rest_ns = std::round((stamp_s - whole) * second_ns);
  const bool is_whole_us = whole + rest_us / 1e6 == stamp_s;
  return std::llround(whole) * std::int64_t{1'000'000'000} +
         std::llround(is_whole_us ? 1e3 * rest_us : rest_ns);
}

}  // namespace panonav
