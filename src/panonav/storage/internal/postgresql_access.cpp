// Making and finding memories on a server.

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/postgresql_tables.hpp"

#ifdef PANONAV_WITH_POSTGRESQL

#include <utility>

#include "panonav/storage/internal/postgresql_memory.hpp"
#include "panonav/storage/internal/postgresql_schema.hpp"
#include "panonav/storage/memory_header.hpp"

namespace panonav {

MemoriesConnection connect_to_memories(const ServerAddress& address, bool make_schema) {
  PostgresqlConnection connection(address);
  int version = schema_version(connection);
  if (version == 0 && make_schema) {
    create_schema_if_missing(connection);
    version = schema_version(connection);
  }
  if (version != 0 && version != postgresql_schema_version) {
    throw FileError(address.shown.native(),
                    "has schema version " + std::to_string(version) +
                        "; allowed: " + std::to_string(postgresql_schema_version));
  }
  return {std::move(connection), version != 0};
}

std::optional<FoundMemory> find_memory(MemoriesConnection& memories, const ServerAddress& address) {
  if (!memories.has_schema) return std::nullopt;
  PostgresqlValues values;
  values.add(std::string_view(address.memory));
  if (address.fleet) values.add(std::string_view(*address.fleet));
  const PostgresqlRows rows = memories.connection.run(
      std::string("SELECT id, channel FROM panonav.memories WHERE name = $1 AND fleet = ") +
          (address.fleet ? "$2" : "panonav.fleet()"),
      values);
  if (rows.size() == 0) return std::nullopt;
  return FoundMemory{rows.integer(0, 0), std::string(rows.text(0, 1))};
}

void refuse_no_memory(const ServerAddress& address) {
  throw FileError(address.shown.native(),
                  "there is no memory '" + address.memory +
                      "' on this server that this login may see; panonav memorise makes one");
}

bool postgresql_memory_exists(const ServerAddress& address) {
  MemoriesConnection memories = connect_to_memories(address, false);
  return find_memory(memories, address).has_value();
}

void make_postgresql_memory(const ServerAddress& address, const MemoryHeader& header,
                            const std::function<void(MemoryTables&)>& fill) {
  validate(header);
  PostgresqlConnection connection = connect_to_memories(address, true).connection;
  connection.execute("BEGIN");
  PostgresqlValues values;
  values.add(std::string_view(address.memory));
  if (address.fleet) values.add(std::string_view(*address.fleet));
  const PostgresqlRows made =
      connection.run(std::string("INSERT INTO panonav.memories(name, fleet) VALUES ($1, ") +
                         (address.fleet ? "$2" : "panonav.fleet()") +
                         ") ON CONFLICT DO NOTHING RETURNING id, channel",
                     values);
  if (made.size() == 0) {
    throw FileError(address.shown.native(), "is there already; allowed: a name that is free");
  }
  PostgresqlTables tables(address, std::move(connection), made.integer(0, 0),
                          std::string(made.text(0, 1)));
  for (const auto& [key, value] : settings_of(header)) tables.write_setting(key, value);
  if (fill) fill(tables);
  tables.commit_made();
}

std::unique_ptr<MemoryTables> open_postgresql_tables(const ServerAddress& address, Access access) {
  MemoriesConnection memories = connect_to_memories(address, false);
  const auto found = find_memory(memories, address);
  if (!found) refuse_no_memory(address);
  if (access == Access::read_write &&
      memories.connection.run("SELECT has_table_privilege('panonav.views', 'INSERT')::int4::int8")
              .integer(0, 0) == 0) {
    throw FileError(address.shown.native(),
                    "cannot be changed: this login is no member of panonav_contributor, which "
                    "adds, or of panonav_curator, which also changes and removes");
  }
  return std::make_unique<PostgresqlTables>(address, std::move(memories.connection), found->id,
                                            found->channel);
}

}  // namespace panonav

#else

namespace panonav {

namespace {

[[noreturn]] void refuse_server(const ServerAddress& address) {
  throw FileError(address.shown.native(),
                  "is on a server, and this panonav was built without PostgreSQL (libpq-dev); "
                  "allowed: the path of a memory file");
}

}  // namespace

void make_postgresql_memory(const ServerAddress& address, const MemoryHeader&,
                            const std::function<void(MemoryTables&)>&) {
  refuse_server(address);
}

std::unique_ptr<MemoryTables> open_postgresql_tables(const ServerAddress& address, Access) {
  refuse_server(address);
}

bool postgresql_memory_exists(const ServerAddress& address) {
  refuse_server(address);
}

}  // namespace panonav

#endif
