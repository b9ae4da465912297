#pragma once

#include <optional>

#include "panonav_fleet/internal/postgresql_connection.hpp"

namespace panonav::fleet {

/// Version of the schema `panonav` that `internal/sql` makes. Another version is refused.
inline constexpr int postgresql_schema_version = 1;

/// Version of the schema that is there; nullopt: there is none. Throws FileError when another
/// program made it.
[[nodiscard]] std::optional<int> schema_version(PostgresqlConnection& connection);

/// Makes the schema and the roles where there are none, in one transaction that waits for others
/// that do so. Throws FileError without the rights.
void create_schema_if_missing(PostgresqlConnection& connection);

}  // namespace panonav::fleet
