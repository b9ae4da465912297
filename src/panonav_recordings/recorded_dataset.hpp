#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panonav/io/dataset_readers.hpp"
#include "panonav_recordings/recording.hpp"

namespace panonav::recordings {

/// Reads a recording of topics (`Recording::open`) as a data set: the pictures of one topic, named
/// by their stamps ("1700000000_250000000") and read when they are needed; `source` is their
/// layout. docs/recordings.md has the rules for topics, stamps and frames. Odometry and
/// "/ground_truth" are interpolated between messages at most a second apart; tilt comes from the
/// only Imu with an orientation. Throws FileError: no or several topics of pictures and none named,
/// a topic that is missing or of another type, named frames that no transforms connect, and what
/// `Recording::open` throws. Cost: one pass over the messages. Memory: 400 bytes a picture and 80 a
/// message.
[[nodiscard]] Dataset read_recording(const std::filesystem::path& path, PictureSource source,
                                     const InputOptions::Topics& topics = {});
/// Reads an open recording; errors and entries name `path`.
[[nodiscard]] Dataset read_recording(std::shared_ptr<const Recording> recording,
                                     const std::filesystem::path& path, PictureSource source,
                                     const InputOptions::Topics& topics = {});

/// Summary of a topic.
struct TopicSummary {
  RecordedTopic topic;               ///< its name, type and number of messages
  std::optional<TimeSpan> time;      ///< log times of its first and last message
  std::optional<double> rate_hz;     ///< mean, of two messages or more
  std::optional<std::string> shows;  ///< of pictures: the first one's size and encoding, or format
};

/// Contents of a recording.
struct RecordingSummary {
  std::vector<TopicSummary> topics;  ///< by name
  std::optional<TimeSpan> time;      ///< from the first message to the last; empty without messages
  std::vector<std::string> warnings;  ///< what was damaged or left out, a line each
};

/// Describes the contents of a recording without decoding a picture. Throws FileError.
[[nodiscard]] RecordingSummary describe_recording(const std::filesystem::path& path);

}  // namespace panonav::recordings
