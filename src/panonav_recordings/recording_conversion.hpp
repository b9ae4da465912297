#pragma once

#include <filesystem>
#include <functional>

#include "panonav/io/dataset.hpp"

namespace panonav::recordings {

/// Writes a data set, also one of another recording or a video, as an MCAP file of ROS 2 messages
/// (docs/formats.md, section "Recordings"), which appears whole or not at all. Pictures keep the
/// bytes of their files; their layout is not in it. Headings are left out where not every position
/// has one; where not every picture has a stamp they are one second apart. Returns what every
/// picture has. `advance` is called after each picture. Throws FileError, and ContractError on
/// stamps below 0 or beyond 2038.
Dataset::Fields convert_to_recording(const Dataset& dataset, const std::filesystem::path& file,
                                     const std::function<void()>& advance = {});

/// Writes a data set of a recording or a video as a new folder, which appears whole or not at all.
/// JPEG and PNG keep their bytes, other pictures become PNG. Fields that only some pictures have
/// are left out. Returns the fields of every picture. Throws FileError.
Dataset::Fields convert_to_dataset(const Dataset& recording, const std::filesystem::path& folder,
                                   const std::function<void()>& advance = {});

}  // namespace panonav::recordings
