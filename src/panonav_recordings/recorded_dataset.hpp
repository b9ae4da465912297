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
/// IMU topic, if there is exactly one. Throws FileError if there is no topic of pictures; if a
/// named topic is missing or of another type; if no transforms connect named frames; and as
/// `Recording::open`. Cost: one pass over the messages; packets of a video are copied into a
/// temporary file. Memory: 400 bytes a picture and 88 a message.
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
  std::optional<ImageSize> size;     ///< of the first picture; nullopt: not known, as of a video
};

/// Contents of a recording.
struct RecordingSummary {
  std::vector<TopicSummary> topics;   ///< by name
  std::optional<TimeSpan> time;       ///< nullopt without messages
  std::vector<std::string> warnings;  ///< what was damaged or left out, a line each
};

/// Describes the contents of a recording. Decodes the first picture of each topic with pictures.
/// Throws FileError.
[[nodiscard]] RecordingSummary describe_recording(const std::filesystem::path& path);

}  // namespace panonav::recordings
