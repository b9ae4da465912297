#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "panonav/motion/trajectory.hpp"

namespace panonav {

/// Reads a trajectory in TUM text ("stamp x y z qx qy qz qw" a line, # begins a comment; z and tilt
/// are ignored) or, for a name that ends in .csv, a table with stamp_s, x_m, y_m and heading_deg.
/// Throws FileError that names line, field and value; stamps must be ascending.
[[nodiscard]] std::vector<StampedPose> read_trajectory(const std::filesystem::path& path);

/// Writes TUM text (z = 0, only yaw), or CSV for a name that ends in .csv, completely or not at
/// all.
void write_trajectory(const std::filesystem::path& path, std::span<const StampedPose> trajectory);

}  // namespace panonav
