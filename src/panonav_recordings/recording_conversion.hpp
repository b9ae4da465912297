#pragma once

#include <filesystem>
#include <functional>

#include "panonav/io/dataset.hpp"

namespace panonav::recordings {

/// Writes a data set, or a recording or video opened as one, as an MCAP file of ROS 2 messages
/// (docs/formats.md, section "Recordings"); on failure no file is left. The bytes of JPEG and PNG
/// files are copied; the camera layout is not stored. Headings are written only if all positions
/// have one, and stamps only if all images have one; else images are a second apart. Returns the
/// fields that images have (`find_known_fields`). `advance` is called after each image. Throws
/// FileError, and ContractError on stamps below 0 or beyond 2038.
Dataset::Fields convert_to_recording(const Dataset& dataset, const std::filesystem::path& file,
                                     const std::function<void()>& advance = {});

/// Converts a recording or video to a data set in a new folder; on failure no folder is left. The
/// bytes of JPEG and PNG files are copied, other images become PNG. Returns the fields that images
/// have (`find_known_fields`). `advance` is called after each image. Throws FileError.
Dataset::Fields convert_to_dataset(const Dataset& recording, const std::filesystem::path& folder,
                                   const std::function<void()>& advance = {});

}  // namespace panonav::recordings
