#include "panonav_fleet/internal/postgresql_schema.hpp"

#include <string_view>

#include "panonav/core/error.hpp"
#include "schema_sql.hpp"

namespace panonav::fleet {

namespace {

// The upper 32 bits spell "PNAV", so that no other program uses this lock.
constexpr const char* lock_schema = "SELECT pg_advisory_xact_lock(5786634408840658944)";

}  // namespace

std::optional<int> schema_version(PostgresqlConnection& connection) {
  const auto there = connection.run(
      "SELECT (to_regclass('panonav.schema_version') IS NOT NULL)::int4::int8, "
      "(EXISTS (SELECT FROM pg_namespace WHERE nspname = 'panonav'))::int4::int8");
  if (there.integer(0, 0) == 0) {
    if (there.integer(0, 1) != 0 &&
        connection.run("SELECT has_schema_privilege('panonav', 'USAGE')::int4::int8")
                .integer(0, 0) != 0) {
      throw FileError(connection.printable().native(),
                      "cannot be used: the database has a schema panonav of another program");
    }
    return std::nullopt;
  }
  return static_cast<int>(
      connection.run("SELECT version::int8 FROM panonav.schema_version").integer(0, 0));
}

void create_schema_if_missing(PostgresqlConnection& connection) {
  connection.execute("BEGIN");
  try {
    connection.execute(lock_schema);
    if (!schema_version(connection)) {
      for (const std::string_view part : {sql::roles_sql, sql::tables_sql, sql::undo_sql,
                                          sql::synchronisation_sql, sql::rights_sql}) {
        connection.execute(std::string(part));
      }
    }
    connection.execute("COMMIT");
  } catch (...) {
    connection.try_execute("ROLLBACK");
    throw;
  }
}

}  // namespace panonav::fleet
