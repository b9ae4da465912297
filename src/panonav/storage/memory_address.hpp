#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace panonav {

/// Whether this is the address of a memory on a server instead of the path of a file: it begins
/// with a registered scheme (memory_scheme.hpp).
[[nodiscard]] bool is_server_address(const std::filesystem::path& memory);

/// Whether something is at the path, or a memory of that name on the server. Throws FileError when
/// the server cannot be asked.
[[nodiscard]] bool memory_exists(const std::filesystem::path& memory);

/// What people call the memory: the name of its file, or its name on the server.
[[nodiscard]] std::string memory_name(const std::filesystem::path& memory);

/// The text with "***" for each password in addresses of servers: what may be printed.
[[nodiscard]] std::string without_passwords(std::string_view text);

}  // namespace panonav
