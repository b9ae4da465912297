#pragma once

#include <filesystem>

#include "panonav/io/dataset_readers.hpp"

namespace panonav {

/// True if the folder has a dataset.toml, which describes the layout of its pictures.
[[nodiscard]] bool has_dataset_file(const std::filesystem::path& folder);

/// Opens a data set (a folder with dataset.toml), a folder of pictures, one picture, or what a
/// registered reader recognises (`register_dataset_reader`), such as a video. Its warnings name
/// what was left out, an elevation band that looks like radians, and pictures that look as if they
/// were of another kind than stated.
///
/// Messages name the members of the options, such as 'source' and the option recursive. Throws
/// OptionError where one does not fit the input; FileError: no such file, unknown layout of the
/// pictures, a kind for which no reader is registered, and as `read_dataset` and the readers. Cost:
/// that of the reader; at most the size of the first picture is read.
[[nodiscard]] Dataset open_input(const std::filesystem::path& path,
                                 const InputOptions& options = {});

}  // namespace panonav
