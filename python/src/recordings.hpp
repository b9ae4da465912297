#pragma once

#include <filesystem>

#include "bindings.hpp"
#include "panonav/io/dataset.hpp"

namespace panonav::python {

/// A data set, or a folder of pictures, a picture, a video or a recording of topics that lies as
/// `source` says. Throws FileError.
[[nodiscard]] Dataset open_dataset(const std::filesystem::path& path,
                                   const std::optional<PictureSource>& source);
/// A `Dataset`, or the path of what `open_dataset` reads.
[[nodiscard]] Dataset dataset_from(const py::handle& recording,
                                   const std::optional<PictureSource>& source);

}  // namespace panonav::python
