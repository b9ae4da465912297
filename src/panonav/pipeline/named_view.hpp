#pragma once

#include <string>

#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// The view that a user means: a name first; a number that is no name is an id. Throws FileError
/// that names the file when there is no such view.
[[nodiscard]] ViewId named_view(const MemoryFile& file, const std::string& wanted);

}  // namespace panonav
