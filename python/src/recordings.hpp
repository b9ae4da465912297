#pragma once

#include <filesystem>
#include <optional>

#include "bindings.hpp"
#include "panonav/io/dataset.hpp"

namespace panonav::python {

/// Returns a `Dataset` of Python as it is, or opens a path (`open_input`) and passes its warnings
/// on to Python. Throws OptionError on a source of what says itself how its pictures lie.
[[nodiscard]] Dataset dataset_from(const py::handle& recording,
                                   const std::optional<PictureSource>& source,
                                   const std::optional<PictureSource>& default_source = {});
/// Returns how the pictures lay that the memory was made from; `nullopt` where there is no memory.
[[nodiscard]] std::optional<PictureSource> remembered_source(const std::filesystem::path& memory);

}  // namespace panonav::python
