#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "panonav/io/trajectory_file.hpp"
#include "panonav_recordings/recording.hpp"

namespace panonav::recordings {

/// Reads the poses of one topic of a recording (`Recording::open`): nav_msgs/Odometry, or
/// PoseStamped, PoseWithCovarianceStamped or TransformStamped of geometry_msgs. Stamps are those of
/// the headers, or the times of recording if no header has one; of equal stamps the first pose is
/// kept. The format names the topic. Throws FileError if there is no such topic, if there are
/// several and none is named, or if a message cannot be read.
[[nodiscard]] TrajectoryFile read_recorded_poses(const std::filesystem::path& path,
                                                 const std::optional<std::string>& topic);
/// Reads an open recording; errors name `path`.
[[nodiscard]] TrajectoryFile read_recorded_poses(const Recording& recording,
                                                 const std::filesystem::path& path,
                                                 const std::optional<std::string>& topic);

}  // namespace panonav::recordings
