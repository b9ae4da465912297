#pragma once

#include <filesystem>

#include "panonav/io/dataset_readers.hpp"

namespace panonav {

/// True if the folder has a dataset.toml, which says how its pictures lie.
[[nodiscard]] bool has_dataset_file(const std::filesystem::path& folder);

/// Opens a data set (a folder with dataset.toml), a folder of pictures, one picture, or what a
/// registered reader recognises (`register_dataset_reader`), such as a video. Its warnings name
/// what was left out of a folder or recording, an elevation band that looks like radians, and
/// pictures that look as if they were of another kind than is said.
///
/// Messages quote names of options: 'source', the option image_topic, the option odometry_topic,
/// the option odometry_frames, the option imu_topic, the option recursive, 'from_s', 'to_s', the
/// option every. Throws OptionError where one does not fit the input; FileError: no such file,
/// nothing says how the pictures lie, a kind for which no reader is registered, and what
/// `read_dataset` and the readers throw. Cost: that of the reader; of pictures at most the size of
/// the first one is read.
[[nodiscard]] OpenedDataset open_input(const std::filesystem::path& path,
                                       const InputOptions& options = {});

}  // namespace panonav
