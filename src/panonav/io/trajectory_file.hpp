#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "panonav/motion/trajectory.hpp"

namespace panonav {

/// Units of the numbers of a trajectory.
struct TrajectoryUnits {
  /// Meaning of `StampedPose::stamp_s`.
  enum class Times {
    stamps,         ///< seconds
    image_numbers,  ///< numbers of the images from 0, as the images have no stamps
    none            ///< only the order of the poses has a meaning
  };
  Times times = Times::stamps;  ///< of `stamp_s`
  bool is_metric = true;        ///< false: lengths are in view steps, not metres
  friend bool operator==(const TrajectoryUnits&, const TrajectoryUnits&) = default;
};

/// Poses of a trajectory file.
struct TrajectoryFile {
  std::string format;               ///< name for people: "TUM", "KITTI", "EuRoC", "CSV"
  TrajectoryUnits units;            ///< of `poses`
  std::vector<StampedPose3> poses;  ///< one or more, stamps ascending
  std::size_t repeated = 0;         ///< poses left out, as they repeat the stamp of the one before
  bool has_rotations = true;        ///< false: positions only; all rotations are the identity
  bool is_estimate = false;  ///< poses of odometry or localisation, which are no ground truth
};

/// Reads a trajectory whose format its first line of data decides: TUM text ("stamp x y z qx qy qz
/// qw"), KITTI (the 12 numbers of a 3 x 4 matrix, no stamps), EuRoC (CSV of nanoseconds, x, y, z,
/// qw, qx, qy, qz; further columns are ignored), positions (stamp, x, y, z), or a CSV table with
/// the columns x_m and y_m and, if known, heading_deg and stamp_s. Lines that begin with # are
/// comments. Units are those of `write_trajectory`; without stamps, a row of a table with the
/// column "file" is an image. Of poses with the same stamp, the first is kept. Throws FileError
/// that names line, field and value, also if stamps descend.
[[nodiscard]] TrajectoryFile read_trajectory_file(const std::filesystem::path& path);

/// Reads a trajectory in the plane: z and tilt are ignored. Throws FileError as
/// `read_trajectory_file`, also for a file without stamps or headings or with lengths in view
/// steps. `repeated`, if not null, is increased by the number of poses left out.
[[nodiscard]] std::vector<StampedPose> read_trajectory(const std::filesystem::path& path,
                                                       std::size_t* repeated = nullptr);

/// Writes TUM text (z = 0, only yaw), or CSV for a name that ends in .csv, completely or not at
/// all. Units other than seconds and metres are stated in comments of TUM text ("# unit: view
/// steps", "# stamps: image numbers" or "none") and by the names of the columns of CSV (x_steps;
/// image or view instead of stamp_s).
void write_trajectory(const std::filesystem::path& path, std::span<const StampedPose> trajectory,
                      const TrajectoryUnits& units = {});

}  // namespace panonav
