#pragma once

#include <optional>

#include "panonav_fleet/internal/postgresql_connection.hpp"

namespace panonav::fleet {

/// Version of the schema `panonav` that the SQL in `internal/sql` creates; servers with another
/// version are refused.
inline constexpr int postgresql_schema_version = 1;

/// Returns the version of the existing schema; nullopt if there is none. Throws FileError if
/// another program made a schema of this name.
[[nodiscard]] std::optional<int> schema_version(PostgresqlConnection& connection);

/// Creates the schema and the roles if they are missing, in one transaction that waits for clients
/// that do the same. Throws FileError if the login lacks the rights.
void create_schema_if_missing(PostgresqlConnection& connection);

}  // namespace panonav::fleet
