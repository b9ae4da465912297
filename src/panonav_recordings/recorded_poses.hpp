#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "panonav/io/trajectory_file.hpp"
#include "panonav_recordings/recording.hpp"

namespace panonav::recordings {

/// Purpose of recorded poses, which decides between several topics.
enum class PoseUse {
  estimate,     ///< compared with the truth; topics named as ground truth come last
  ground_truth  ///< topics named as ground truth come first; odometry only if it is named
};

/// Reads the poses of one topic of a recording (`Recording::open`): nav_msgs/Odometry, PoseStamped,
/// PoseWithCovarianceStamped, TransformStamped or PointStamped (positions only) of geometry_msgs,
/// or of transforms: base_link, base_footprint or the camera in the frame map or world (for an
/// estimate also odom), at the stamps of the most frequent transform of the chain. Stamps are those
/// of the headers, or the times of recording if no header has one; of equal stamps the first pose
/// is kept. The format names the topic. Throws FileError if there is no such topic, if there are
/// several and none is named, if transforms do not connect the frames, or if a message cannot be
/// read.
[[nodiscard]] TrajectoryFile read_recorded_poses(const std::filesystem::path& path,
                                                 const std::optional<std::string>& topic,
                                                 PoseUse use = PoseUse::estimate);
/// Reads an open recording; errors name `path`.
[[nodiscard]] TrajectoryFile read_recorded_poses(const Recording& recording,
                                                 const std::filesystem::path& path,
                                                 const std::optional<std::string>& topic,
                                                 PoseUse use = PoseUse::estimate);

}  // namespace panonav::recordings
