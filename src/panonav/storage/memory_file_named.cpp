// Maps and routes of a memory file, each under a name.

#include <algorithm>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/memory_file_implementation.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/route_tables.hpp"

namespace panonav {

void MemoryFile::save_map(std::string_view name, const TopologicalMap& map) {
  MemoryTables& tables = *implementation_->tables;
  const auto transaction = tables.transaction(MemoryTables::Kind::writing);
  std::vector<ViewId> views;
  for (const MapNode& node : map.nodes) views.push_back(node.view);
  tables.require_views(views);
  write_map(tables, name, map);
  transaction->commit();
}

std::optional<TopologicalMap> MemoryFile::map(std::string_view name) const {
  MemoryTables& tables = *implementation_->tables;
  const auto reading = tables.transaction(MemoryTables::Kind::reading);
  return read_map(tables, name);
}

void MemoryFile::remove_map(std::string_view name) {
  MemoryTables& tables = *implementation_->tables;
  const auto transaction = tables.transaction(MemoryTables::Kind::writing);
  if (!erase_map(tables, name)) {
    throw ContractError("map", std::string(name), "a map of the memory file");
  }
  transaction->commit();
}

std::vector<std::string> MemoryFile::map_names() const {
  MemoryTables& tables = *implementation_->tables;
  const auto reading = tables.transaction(MemoryTables::Kind::reading);
  return tables.map_names();
}

std::size_t MemoryFile::append_route(std::string_view name, const RoutePanorama& more) {
  MemoryTables& tables = *implementation_->tables;
  const auto transaction = tables.transaction(MemoryTables::Kind::writing);
  const std::size_t appended = append_to_route(tables, name, more);
  transaction->commit();
  return appended;
}

std::optional<RoutePanorama> MemoryFile::route(std::string_view name) const {
  MemoryTables& tables = *implementation_->tables;
  const auto reading = tables.transaction(MemoryTables::Kind::reading);
  return read_route(tables, name);
}

std::uint64_t MemoryFile::route_bytes(std::string_view name) const {
  MemoryTables& tables = *implementation_->tables;
  const auto reading = tables.transaction(MemoryTables::Kind::reading);
  const std::int64_t bytes = tables.route_bytes(name);
  if (bytes == 0) throw ContractError("route", std::string(name), "a route of the memory file");
  return static_cast<std::uint64_t>(bytes);
}

void MemoryFile::remove_route(std::string_view name) {
  MemoryTables& tables = *implementation_->tables;
  const auto transaction = tables.transaction(MemoryTables::Kind::writing);
  if (!erase_route(tables, name)) {
    throw ContractError("route", std::string(name), "a route of the memory file");
  }
  transaction->commit();
}

void MemoryFile::rename_route(std::string_view name, std::string_view new_name) {
  require_name("route", new_name);
  MemoryTables& tables = *implementation_->tables;
  const auto transaction = tables.transaction(MemoryTables::Kind::writing);
  const auto names = route_names();
  if (std::ranges::find(names, name) == names.end()) {
    throw ContractError("route", std::string(name), "a route of the memory file");
  }
  if (std::ranges::find(names, new_name) != names.end()) {
    refuse_taken_name("route", new_name, path());
  }
  panonav::rename_route(tables, name, new_name);
  // How its pictures became lines goes with it.
  const std::string from = "route." + std::string(name);
  if (const auto lines = parameter(from)) {
    set_parameter("route." + std::string(new_name), *lines);
    tables.erase_setting("parameter." + from);
  }
  transaction->commit();
}

std::vector<std::string> MemoryFile::route_names() const {
  MemoryTables& tables = *implementation_->tables;
  const auto reading = tables.transaction(MemoryTables::Kind::reading);
  return tables.route_names();
}

}  // namespace panonav
