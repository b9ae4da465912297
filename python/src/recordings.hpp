#pragma once

#include <filesystem>
#include <optional>

#include "bindings.hpp"
#include "panonav/io/dataset.hpp"

namespace panonav::python {

/// Returns a Python `Dataset` unchanged, opens a path (`open_input`) and issues its warnings in
/// Python, or makes a data set of an image or a list of images. Throws OptionError if `source` is
/// set for data that states its own image layout.
[[nodiscard]] Dataset to_dataset(const py::handle& recording,
                                 const std::optional<PictureSource>& source,
                                 const std::optional<PictureSource>& default_source = {});
/// Throws OptionError with the corrected order if the input has the name of a memory, and the
/// memory has not.
void require_memory_first(const std::filesystem::path& memory, const py::handle& input);
/// Does the same as `to_dataset` for the input of a function that takes a memory first; the default
/// layout is that of the images from which the memory was made, if it exists. Checks the order of
/// both.
[[nodiscard]] Dataset to_dataset_for_memory(const std::filesystem::path& memory,
                                            const py::handle& recording,
                                            const std::optional<PictureSource>& source);

}  // namespace panonav::python
