#pragma once

#include <filesystem>
#include <optional>

#include "bindings.hpp"
#include "panonav/io/dataset.hpp"

namespace panonav::python {

/// Returns a Python `Dataset` unchanged, or opens a path (`open_input`) and issues its warnings in
/// Python. Throws OptionError if `source` is set for data that states its own image layout.
[[nodiscard]] Dataset to_dataset(const py::handle& recording,
                                 const std::optional<PictureSource>& source,
                                 const std::optional<PictureSource>& default_source = {});
/// Returns the layout of the images from which the memory was made; nullopt if there is no memory.
[[nodiscard]] std::optional<PictureSource> read_stored_source(const std::filesystem::path& memory);

}  // namespace panonav::python
