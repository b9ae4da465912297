#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace panonav {

/// Whether this is the address of a memory on a PostgreSQL server instead of the path of a file:
///
///     postgresql://[USER[:PASSWORD]@][HOST][:PORT]/DATABASE?memory=NAME
///
/// libpq reads the address and takes what it leaves out from the environment, the service file and
/// the password file. Three parameters are panonav's own: `memory` is the name of the memory,
/// `fleet` whose it is where that is not the login's own fleet, and `robot` who adds to it; all
/// others (sslmode, sslrootcert, connect_timeout, ...) are libpq's.
[[nodiscard]] bool is_server_address(const std::filesystem::path& memory);

/// Whether something is at the path, or a memory of that name on the server. Throws FileError when
/// the server cannot be asked.
[[nodiscard]] bool memory_exists(const std::filesystem::path& memory);

/// What people call the memory: the name of its file, or its name on the server.
[[nodiscard]] std::string memory_name(const std::filesystem::path& memory);

/// The text with "***" for each password in addresses of servers: what may be printed.
[[nodiscard]] std::string without_passwords(std::string_view text);

}  // namespace panonav
