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
  MessageLocation place;
  std::int64_t stamp_ns = 0;  ///< of its header
};

/// Collects the messages of the chosen topics of a recording.
struct RecordedMessages {
  std::vector<RecordedPicture> pictures;  ///< one or more, in the order of their recording
  RecordedTrack odometry;                 ///< empty where `chain` gives it
  RecordedTrack orientation;              ///< of the inertial sensor; positions mean nothing
  RecordedTrack truth;
  std::optional<TransformChain> chain;  ///< connected
  bool truth_has_headings = true;
  std::pair<std::uint32_t, std::uint32_t> first_size;  ///< width and height of the first picture
  std::size_t other_sizes = 0;                         ///< pictures of another size
  std::size_t without_orientation = 0;  ///< messages of the inertial sensor that state none
  std::vector<std::string> warnings;    ///< those of the choice, then what was left out

  /// Sorts poses by the stamps of headers, or by the times of recording, with a warning, where a
  /// topic has no stamps. Returns true if it is by the times of recording.
  [[nodiscard]] bool sort();
};

/// Reads all messages of the chosen topics in one pass. Throws FileError, naming `path`: too many
/// messages, no picture that can be read, named frames that no transforms connect.
[[nodiscard]] RecordedMessages collect_messages(const std::filesystem::path& path,
                                                const Recording& recording,
                                                const TopicChoice& choice);

}  // namespace panonav::recordings
