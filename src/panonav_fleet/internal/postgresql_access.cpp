// Creates, finds and opens memories on a PostgreSQL server.

#include <chrono>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/memory_header.hpp"
#include "panonav/storage/memory_scheme.hpp"
#include "panonav_fleet/internal/postgresql_memory.hpp"
#include "panonav_fleet/internal/postgresql_schema.hpp"
#include "panonav_fleet/memory_changes.hpp"
#include "panonav_fleet/place_search.hpp"
#include "panonav_fleet/postgresql_memories.hpp"

namespace panonav::fleet {

MemoriesConnection connect_to_memories(const ServerAddress& address, bool make_schema) {
  PostgresqlConnection connection(address);
  auto version = schema_version(connection);
  if (!version && make_schema) {
    create_schema_if_missing(connection);
    version = schema_version(connection);
  }
  if (version && *version != postgresql_schema_version) {
    throw FileError(address.printable.native(),
                    "has schema version " + std::to_string(*version) +
                        "; allowed: " + std::to_string(postgresql_schema_version));
  }
  return {std::move(connection), version.has_value()};
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

void throw_missing_memory(const ServerAddress& address) {
  throw FileError(address.printable.native(), "there is no memory '" + address.memory +
                                                  "' on this server that this login may see");
}

void create_postgresql_memory(const ServerAddress& address, const MemoryHeader& header,
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
    throw FileError(address.printable.native(), "already exists; allowed: a name that is free");
  }
  PostgresqlTables tables(address, std::move(connection), made.integer(0, 0),
                          std::string(made.text(0, 1)));
  for (const auto& [key, value] : to_settings(header)) tables.write_setting(key, value);
  if (fill) fill(tables);
  tables.commit_creation();
}

namespace {

class PostgresqlScheme final : public MemoryScheme {
 public:
  [[nodiscard]] bool exists(const std::filesystem::path& address) const override {
    const ServerAddress parsed = parse_server_address(address);
    MemoriesConnection memories = connect_to_memories(parsed, false);
    return find_memory(memories, parsed).has_value();
  }

  [[nodiscard]] std::string get_memory_name(const std::filesystem::path& address) const override {
    return parse_server_address(address).memory;
  }

  void create(const std::filesystem::path& address, const MemoryHeader& header,
              const std::function<void(MemoryTables&)>& fill) const override {
    create_postgresql_memory(parse_server_address(address), header, fill);
  }

  [[nodiscard]] std::unique_ptr<MemoryTables> open(const std::filesystem::path& address,
                                                   Access access) const override {
    return open_tables(parse_server_address(address), access);
  }

  [[nodiscard]] std::function<bool()> listen(const std::filesystem::path& address) const override {
    return [changes = std::make_shared<MemoryChanges>(address)] {
      bool changed = false;
      while (changes->wait(std::chrono::milliseconds(0))) changed = true;
      return changed;
    };
  }

  [[nodiscard]] std::unique_ptr<IndexedMemory> open_index(
      const std::filesystem::path& address) const override {
    return std::make_unique<PlaceSearch>(address);
  }

 private:
  static std::unique_ptr<MemoryTables> open_tables(const ServerAddress& address, Access access) {
    MemoriesConnection memories = connect_to_memories(address, false);
    const auto found = find_memory(memories, address);
    if (!found) throw_missing_memory(address);
    if (access == Access::read_write &&
        memories.connection.run("SELECT has_table_privilege('panonav.views', 'INSERT')::int4::int8")
                .integer(0, 0) == 0) {
      throw FileError(address.printable.native(),
                      "cannot be changed: this login is not a member of panonav_contributor, which "
                      "adds, or of panonav_curator, which also changes and removes");
    }
    return std::make_unique<PostgresqlTables>(address, std::move(memories.connection), found->id,
                                              found->channel);
  }
};

}  // namespace

void register_postgresql_memories() {
  const auto scheme = std::make_shared<const PostgresqlScheme>();
  for (const char* const name : {"postgresql", "postgres"}) register_memory_scheme(name, scheme);
}

}  // namespace panonav::fleet
