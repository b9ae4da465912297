#pragma once

#include <gtest/gtest.h>

#include <algorithm>

#include "panonav/core/random.hpp"
#include "panonav_recordings/mcap_writer.hpp"
#include "panonav_recordings/recording.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::recordings {
using namespace testing;

namespace fs = std::filesystem;

struct Message {
  std::string topic;
  std::int64_t time_ns = 0;
  std::vector<std::uint8_t> bytes;
  friend bool operator==(const Message&, const Message&) = default;
};
using Messages = std::vector<Message>;

inline void PrintTo(const Message& message, std::ostream* out) {
  *out << message.topic << " " << message.time_ns << " " << message.bytes.size();
}

inline std::vector<std::uint32_t> all_topics(const Recording& recording) {
  std::vector<std::uint32_t> topics(recording.topics().size());
  for (std::uint32_t i = 0; i < topics.size(); ++i) topics[i] = i;
  return topics;
}

inline Messages in_sequence(const Recording& recording, std::optional<TimeSpan> within = {}) {
  Messages messages;
  recording.for_each(all_topics(recording), within,
                     [&](const MessageLocation& location, auto bytes) {
                       messages.push_back({recording.topics()[location.topic].name,
                                           location.time_ns,
                                           {bytes.begin(), bytes.end()}});
                     });
  return messages;
}

inline Messages one_by_one(const Recording& recording, std::optional<TimeSpan> within = {}) {
  Messages messages;
  for (const auto& location : recording.locations(all_topics(recording), within)) {
    messages.push_back(
        {recording.topics()[location.topic].name, location.time_ns, recording.read(location)});
  }
  return messages;
}

// The messages of `tests/io/mcap_core.mjs`, as they lie in tests/io/data.
inline Messages golden_messages() {
  Messages messages;
  for (int i = 0; i < 20; ++i) {
    Message message{i % 3 == 2 ? "/text" : "/imu", 1'000'000'000LL + 10'000'000LL * i, {}};
    for (int k = 0; k < 10 + 3 * i; ++k) {
      message.bytes.push_back(static_cast<std::uint8_t>(7 * i + k));
    }
    messages.push_back(std::move(message));
  }
  return messages;
}

inline fs::path golden(std::string_view name) {
  return fs::path(PANONAV_TEST_DATA) / name;
}

struct Written {
  Messages messages;  ///< in order of time
  fs::path path;
};

inline constexpr const char* three_topics[] = {"/a", "/b", "/c"};

// Random messages of three topics, out of order by up to `jump_ns`.
inline Written write_some(const fs::path& path, const McapWriterOptions& options, int count,
                          std::uint64_t seed, std::size_t largest = 300, int jump_ns = 50) {
  Random random(seed);
  Written written{{}, path};
  McapWriter writer(path, options);
  const auto schema = writer.add_schema("std_msgs/msg/Byte", "ros2msg", "byte data");
  for (const char* topic : three_topics) (void)writer.add_channel(topic, "cdr", schema);
  for (int i = 0; i < count; ++i) {
    const auto channel = static_cast<std::uint16_t>(random.index(3));
    Message message{
        three_topics[channel],
        1000 + 10 * i + static_cast<int>(random.index(static_cast<std::uint64_t>(jump_ns))),
        std::vector<std::uint8_t>(random.index(largest + 1))};
    const bool is_even = random.index(2) == 0;  // so that some can be packed
    for (auto& byte : message.bytes) {
      byte = is_even ? std::uint8_t{7} : static_cast<std::uint8_t>(random.next());
    }
    writer.write(channel, message.time_ns, message.time_ns, message.bytes);
    written.messages.push_back(std::move(message));
  }
  writer.close();
  std::ranges::stable_sort(written.messages, {}, &Message::time_ns);
  return written;
}

class RecordingTest : public InTemporaryFolder {};

}  // namespace panonav::recordings
