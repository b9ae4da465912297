// Maps and routes of a memory file, each under a name.

#include <algorithm>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/memory_file_implementation.hpp"
#include "panonav/storage/internal/memory_schema.hpp"
#include "panonav/storage/internal/route_tables.hpp"

namespace panonav {

void MemoryFile::save_map(std::string_view name, const TopologicalMap& map) {
  Database& database = implementation_->database;
  Transaction transaction(database, Transaction::Kind::writing);
  for (const MapNode& node : map.nodes) {
    if (!implementation_->contains(node.view)) refuse_view(node.view);
  }
  write_map(database, name, map);
  transaction.commit();
}

std::optional<TopologicalMap> MemoryFile::map(std::string_view name) const {
  Database& database = implementation_->database;
  const Transaction reading(database, Transaction::Kind::reading);
  if (!has_map_table(database)) return std::nullopt;
  return read_map(database, name);
}

void MemoryFile::remove_map(std::string_view name) {
  Database& database = implementation_->database;
  Transaction transaction(database, Transaction::Kind::writing);
  if (!has_map_table(database) || !erase_map(database, name)) {
    throw ContractError("map", std::string(name), "a map of the memory file");
  }
  transaction.commit();
}

std::vector<std::string> MemoryFile::map_names() const {
  Database& database = implementation_->database;
  const Transaction reading(database, Transaction::Kind::reading);
  if (!has_map_table(database)) return {};
  return panonav::map_names(database);
}

std::size_t MemoryFile::append_route(std::string_view name, const RoutePanorama& more) {
  Database& database = implementation_->database;
  Transaction transaction(database, Transaction::Kind::writing);
  const std::size_t appended = append_to_route(database, name, more);
  transaction.commit();
  return appended;
}

std::optional<RoutePanorama> MemoryFile::route(std::string_view name) const {
  Database& database = implementation_->database;
  const Transaction reading(database, Transaction::Kind::reading);
  if (!has_route_tables(database)) return std::nullopt;
  return read_route(database, name);
}

std::uint64_t MemoryFile::route_bytes(std::string_view name) const {
  Database& database = implementation_->database;
  const Transaction reading(database, Transaction::Kind::reading);
  const std::size_t bytes = has_route_tables(database) ? panonav::route_bytes(database, name) : 0;
  if (bytes == 0) throw ContractError("route", std::string(name), "a route of the memory file");
  return bytes;
}

void MemoryFile::remove_route(std::string_view name) {
  Database& database = implementation_->database;
  Transaction transaction(database, Transaction::Kind::writing);
  if (!has_route_tables(database) || !erase_route(database, name)) {
    throw ContractError("route", std::string(name), "a route of the memory file");
  }
  transaction.commit();
}

void MemoryFile::rename_route(std::string_view name, std::string_view new_name) {
  require_name("route", new_name);
  Database& database = implementation_->database;
  Transaction transaction(database, Transaction::Kind::writing);
  const auto names = route_names();
  if (std::ranges::find(names, name) == names.end()) {
    throw ContractError("route", std::string(name), "a route of the memory file");
  }
  if (std::ranges::find(names, new_name) != names.end()) {
    refuse_taken_name("route", new_name, path());
  }
  panonav::rename_route(database, name, new_name);
  // How its pictures became lines goes with it.
  const std::string from = "route." + std::string(name);
  if (const auto lines = parameter(from)) {
    set_parameter("route." + std::string(new_name), *lines);
    Statement erase(database, "DELETE FROM settings WHERE key = ?");
    const std::string key = "parameter." + from;
    static_cast<void>(erase.bind(1, std::string_view(key)).run());
  }
  transaction.commit();
}

std::vector<std::string> MemoryFile::route_names() const {
  Database& database = implementation_->database;
  const Transaction reading(database, Transaction::Kind::reading);
  if (!has_route_tables(database)) return {};
  return panonav::route_names(database);
}

}  // namespace panonav
