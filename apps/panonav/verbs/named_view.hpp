#pragma once

#include <string>

#include "panonav/memory/visual_memory.hpp"

namespace panonav::command {

/// The view that a user means: a name first; a number that is no name is an id. Throws FileError
/// that names `file` when there is no such view.
[[nodiscard]] ViewId named_view(const VisualMemory& memory, const std::string& wanted,
                                const std::string& file);

}  // namespace panonav::command
