#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav_recordings/internal/recorded_topics.hpp"
#include "panonav_recordings/internal/recorded_track.hpp"
#include "panonav_recordings/recording.hpp"

namespace panonav::recordings {

/// A picture of a recording that is not decoded yet.
struct RecordedPicture {
  MessageLocation location;
  std::int64_t stamp_ns = 0;  ///< of the message header; 0: none
};

/// Collects the messages of the chosen topics of a recording.
struct RecordedMessages {
  std::vector<RecordedPicture> pictures;  ///< one or more, in the order of their recording
  RecordedTrack odometry;                 ///< empty if `chain` gives the odometry
  RecordedTrack orientation;              ///< of the IMU; its positions are unused
  RecordedTrack truth;
  std::optional<TransformChain> chain;  ///< connected transforms that give the odometry
  bool truth_has_headings = true;
  std::pair<std::uint32_t, std::uint32_t> first_size;  ///< width and height of the first picture
  std::size_t differing_size_count = 0;                ///< pictures of another size
  std::size_t imu_without_orientation_count = 0;       ///< IMU messages without orientation
  std::vector<std::string> warnings;  ///< of the topic choice, then of messages left out

  /// Sorts all poses by header stamps, or, with a warning, by log times if a topic has no stamps.
  /// Returns true if log times are used.
  [[nodiscard]] bool sort();
};

/// Reads all messages of the chosen topics in one pass. Throws FileError that names `path` if there
/// are too many messages or no readable picture, or no transforms connect the frames that the
/// caller named.
[[nodiscard]] RecordedMessages collect_messages(const std::filesystem::path& path,
                                                const Recording& recording,
                                                const TopicChoice& choice);

}  // namespace panonav::recordings
