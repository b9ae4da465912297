#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace panonav::fleet {

/// The parts of the address of a memory on a server (memory_address.hpp).
struct ServerAddress {
  std::string uri;                  ///< what libpq reads: without panonav's own parameters
  std::filesystem::path printable;  ///< the address without its password
  std::string memory;
  std::optional<std::string> fleet;
  std::optional<std::string> robot;
};

/// True if the path begins as the address of a PostgreSQL server.
[[nodiscard]] bool is_postgresql_address(const std::filesystem::path& memory);

/// Parses an address; throws FileError unless it is valid and names a memory.
[[nodiscard]] ServerAddress parse_server_address(const std::filesystem::path& memory);

}  // namespace panonav::fleet
