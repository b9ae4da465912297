#pragma once

#include <filesystem>

#include "panonav/io/dataset_readers.hpp"

namespace panonav {

/// True if the folder has a dataset.toml, which describes the layout of its pictures.
[[nodiscard]] bool has_dataset_file(const std::filesystem::path& folder);

/// Opens a data set (a folder with dataset.toml), a folder of pictures, one picture, or what a
/// registered reader recognises (`register_dataset_reader`), such as a video. The warnings list
/// skipped files, elevations that are probably in radians, and pictures that are probably of
/// another kind than stated. GPano data give the tilt of pictures and their part of the sphere
/// (`apply_gpano`).
///
/// Messages mention options by name, such as 'source' and the option recursive. Throws OptionError
/// if an option does not fit the input; FileError if there is no such file, the layout of the
/// pictures is unknown or no reader is registered for this kind, and like `read_dataset` and the
/// readers. Cost: that of the reader; reads the heads of pictures.
[[nodiscard]] Dataset open_input(const std::filesystem::path& path,
                                 const InputOptions& options = {});

}  // namespace panonav
