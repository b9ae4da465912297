#pragma once

#include <filesystem>
#include <string>

#include "panonav/core/address.hpp"

namespace panonav {

/// True if this is the address of a memory on a server, which begins with a registered scheme
/// (memory_scheme.hpp), and not the path of a file.
[[nodiscard]] bool is_server_address(const std::filesystem::path& memory);

/// True if something is at the path, or the server has a memory of that name. Throws FileError if
/// the server cannot be reached.
[[nodiscard]] bool memory_exists(const std::filesystem::path& memory);

/// Returns the file name of the memory, or its name on the server.
[[nodiscard]] std::string memory_name(const std::filesystem::path& memory);

}  // namespace panonav
