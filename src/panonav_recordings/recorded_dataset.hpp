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

/// Reads a recording of topics (`Recording::open`) as a data set of the pictures of one topic.
/// Pictures are named by their stamps ("1700000000_250000000") and read when needed; `source` is
/// their layout. docs/recordings.md has the rules for topics, stamps and frames. Odometry and
/// "/ground_truth" are interpolated between messages at most a second apart; tilt comes from the
/// IMU topic, if there is exactly one. Throws FileError if there is no topic of pictures, or
/// several and none is named; if a named topic is missing or of another type; if no transforms
/// connect named frames; and as `Recording::open`. Cost: one pass over the messages. Memory: 400
/// bytes a picture and 80 a message.
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
  std::optional<double> rate_hz;     ///< mean; nullopt for one message
  std::optional<std::string> shows;  ///< format or size and encoding of the first picture
};

/// Contents of a recording.
struct RecordingSummary {
  std::vector<TopicSummary> topics;   ///< by name
  std::optional<TimeSpan> time;       ///< nullopt without messages
  std::vector<std::string> warnings;  ///< what was damaged or left out, a line each
};

/// Describes the contents of a recording without decoding a picture. Throws FileError.
[[nodiscard]] RecordingSummary describe_recording(const std::filesystem::path& path);

}  // namespace panonav::recordings
