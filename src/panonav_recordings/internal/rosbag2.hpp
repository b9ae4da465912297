#pragma once

#include <filesystem>
#include <vector>

namespace panonav::recordings {

/// Returns the files that the metadata.yaml of a rosbag2 folder lists, in that order, as paths in
/// the folder; files may be missing. Throws FileError.
[[nodiscard]] std::vector<std::filesystem::path> read_rosbag2_folder(
    const std::filesystem::path& folder);

}  // namespace panonav::recordings
