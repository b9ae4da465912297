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

/// What a recording of topics (`Recording::open`) tells as a data set: the pictures of one topic in
/// order of their recording, named by their stamps ("1700000000_250000000"), which are read when
/// they are needed. `source` says how they lie; a recording cannot.
///
/// - Of several topics of pictures "/panorama/compressed" and "/best_match/compressed", which
///   records of runs have beside their camera's, are passed over unless named.
/// - Stamps are those of the headers; where all of a topic are 0, log times serve for all topics.
/// - Odometry is interpolated between the messages before and after the picture, and extrapolated
///   over one interval between messages at either end. It is missing further out and in gaps of
///   more than a second. It comes from the only topic of nav_msgs/Odometry or, without one, from
///   the transforms from "odom" to "base_link".
/// - Tilt is roll and pitch of the only topic of sensor_msgs/Imu that states an orientation. The
///   sensor is taken to be mounted as REP 103 says (x forward, z up); more than 30 degrees are
///   left out. A topic that was not named is not used for panoramas whose elevations are unknown,
///   which could not be levelled.
/// - Poses are those of "/ground_truth" (PoseStamped or PointStamped), interpolated likewise.
///
/// Throws FileError: no or several topics of pictures and none named, a topic that is not there or
/// of another type, named frames that no chain of transforms connects, and what
/// `Recording::open` throws. Cost: one pass over the messages of these topics. Memory: 400 bytes a
/// picture and 80 a message of the other topics, of which there may be 10 million; a million
/// pictures.
[[nodiscard]] OpenedDataset read_recording(const std::filesystem::path& path, PictureSource source,
                                           const InputOptions::Topics& topics = {});
/// The same of a recording that is open; `path` stands in errors and entries.
[[nodiscard]] OpenedDataset read_recording(std::shared_ptr<const Recording> recording,
                                           const std::filesystem::path& path, PictureSource source,
                                           const InputOptions::Topics& topics = {});

/// One topic as `describe_recording` knows it.
struct TopicSummary {
  RecordedTopic topic;               ///< its name, type and number of messages
  std::optional<TimeSpan> time;      ///< log times of its first and last message
  std::optional<double> rate_hz;     ///< mean, of two messages or more
  std::optional<std::string> shows;  ///< of pictures: the first one's size and encoding, or format
};

/// What is in a recording.
struct RecordingSummary {
  std::vector<TopicSummary> topics;  ///< by name
  std::optional<TimeSpan> time;      ///< from the first message to the last; empty without messages
  std::vector<std::string> warnings;  ///< what was damaged or left out, a line each
};

/// What is in a recording, without decoding a picture. Throws FileError.
[[nodiscard]] RecordingSummary describe_recording(const std::filesystem::path& path);

}  // namespace panonav::recordings
