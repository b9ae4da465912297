#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "panonav/motion/trajectory.hpp"

namespace panonav {

/// Poses of a trajectory file.
struct TrajectoryFile {
  std::string format;               ///< name for people: "TUM", "KITTI", "EuRoC", "CSV"
  bool has_stamps = true;           ///< false: `stamp_s` counts the poses from 0
  std::vector<StampedPose3> poses;  ///< one or more, stamps ascending
  std::size_t repeated = 0;         ///< poses left out, as they repeat the stamp of the one before
};

/// Reads a trajectory whose format its first line of data decides: TUM text ("stamp x y z qx qy qz
/// qw"), KITTI (the 12 numbers of a 3 x 4 matrix, no stamps), EuRoC (CSV of nanoseconds, x, y, z,
/// qw, qx, qy, qz; further columns are ignored), or a CSV table with the columns stamp_s, x_m, y_m
/// and heading_deg. Lines that begin with # are comments. Of poses with the same stamp, the first
/// is kept. Throws FileError that names line, field and value, also if stamps descend.
[[nodiscard]] TrajectoryFile read_trajectory_file(const std::filesystem::path& path);

/// Reads a trajectory in the plane: z and tilt are ignored. Throws FileError as
/// `read_trajectory_file`, also for a format without stamps. `repeated`, if not null, is increased
/// by the number of poses left out.
[[nodiscard]] std::vector<StampedPose> read_trajectory(const std::filesystem::path& path,
                                                       std::size_t* repeated = nullptr);

/// Writes TUM text (z = 0, only yaw), or CSV for a name that ends in .csv, completely or not at
/// all.
void write_trajectory(const std::filesystem::path& path, std::span<const StampedPose> trajectory);

}  // namespace panonav
