#pragma once

#include <cstdint>
#include <string>

#include "panonav_fleet/internal/postgresql_connection.hpp"

namespace panonav::fleet {

/// The schema `panonav` of a database has at most this version; a newer one is refused.
inline constexpr int postgresql_schema_version = 2;

/// Version of the schema that is there; 0: there is none.
[[nodiscard]] int schema_version(PostgresqlConnection& connection);

/// Whether this login has the rights to change a schema that is there.
[[nodiscard]] bool may_migrate_schema(PostgresqlConnection& connection);

/// Makes the schema and the roles, or brings them to this version, in one transaction that waits
/// for others that do so. Throws FileError without the rights.
void migrate_schema(PostgresqlConnection& connection);

}  // namespace panonav::fleet
