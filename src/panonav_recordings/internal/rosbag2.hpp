#pragma once

#include <filesystem>
#include <vector>

namespace panonav::recordings {

/// The files that the metadata.yaml of a folder of rosbag2 names, in their order, as they are in
/// the folder; they may be missing. Throws FileError.
[[nodiscard]] std::vector<std::filesystem::path> read_rosbag2_folder(
    const std::filesystem::path& folder);

}  // namespace panonav::recordings
