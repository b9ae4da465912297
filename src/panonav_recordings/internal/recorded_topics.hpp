#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panonav/io/dataset_readers.hpp"
#include "panonav/panorama/picture_source.hpp"
#include "panonav_recordings/recording.hpp"

namespace panonav::recordings {

/// Role of the messages of a topic in a data set.
enum class TopicRole { none, picture, odometry, transforms, tilt, truth };

/// Topics of a recording that are used for the data set.
struct TopicChoice {
  std::vector<TopicRole> roles;       ///< of each topic of the recording
  std::vector<std::uint32_t> topics;  ///< those with a role
  /// The frames between which transforms give odometry; `nullopt` if a topic gives it, or nothing
  /// does.
  std::optional<std::pair<std::string, std::string>> frames;
  bool frames_are_named = false;      ///< by the caller; missing ones are then an error
  std::vector<std::string> warnings;  ///< about unused topics, one line each
};

/// Chooses topics by the names given, otherwise by type (rules: `read_recording`); `source` is the
/// layout of the pictures. Throws FileError that names `path`, and ContractError if both a topic of
/// odometry and frames are named.
[[nodiscard]] TopicChoice choose_topics(const Recording& recording,
                                        const std::filesystem::path& path,
                                        const InputOptions::Topics& names,
                                        const PictureSource& source);

}  // namespace panonav::recordings
