// Stores maps, routes and the last change of a memory on a server, and counts its rows.

#include "panonav/core/error.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/memory_schema.hpp"
#include "panonav_fleet/internal/postgresql_memory.hpp"

namespace panonav::fleet {

void PostgresqlTables::write_map(std::string_view name, const MapRow& row) {
  connection_.run(
      "INSERT INTO panonav.maps(memory, name, nodes, edges, checksum) VALUES ($1, $2, $3, $4, $5) "
      "ON CONFLICT (memory, name) DO UPDATE SET nodes = excluded.nodes, edges = excluded.edges, "
      "checksum = excluded.checksum",
      Values()
          .add(memory_)
          .add(name)
          .add(std::span<const std::uint8_t>(row.nodes))
          .add(std::span<const std::uint8_t>(row.edges))
          .add(row.checksum));
}

std::optional<MapRow> PostgresqlTables::map(std::string_view name) {
  const Rows rows =
      run("SELECT nodes, edges, checksum FROM panonav.maps WHERE memory = $1 AND name = $2", name);
  if (rows.size() == 0) return std::nullopt;
  return MapRow{rows.copy(0, 0), rows.copy(0, 1), rows.integer(0, 2)};
}

void PostgresqlTables::erase_map(std::string_view name) {
  run("DELETE FROM panonav.maps WHERE memory = $1 AND name = $2", name);
}

std::vector<std::string> PostgresqlTables::map_names() {
  return query_texts("SELECT name FROM panonav.maps WHERE memory = $1 ORDER BY name");
}

void PostgresqlTables::write_route(std::string_view name, const RouteRow& row) {
  connection_.run(
      "INSERT INTO panonav.routes(memory, name, columns, lines, checksum) VALUES ($1, $2, $3, $4, "
      "$5) ON CONFLICT (memory, name) DO UPDATE SET lines = excluded.lines, checksum = "
      "excluded.checksum",
      Values().add(memory_).add(name).add(row.columns).add(row.lines).add(row.checksum));
}

std::optional<RouteRow> PostgresqlTables::route(std::string_view name) {
  const Rows rows = run(
      "SELECT columns, lines, checksum FROM panonav.routes WHERE memory = $1 AND name = $2", name);
  if (rows.size() == 0) return std::nullopt;
  return RouteRow{rows.integer(0, 0), rows.integer(0, 1), rows.integer(0, 2)};
}

void PostgresqlTables::erase_route(std::string_view name) {
  run("DELETE FROM panonav.route_blocks WHERE memory = $1 AND route = $2", name);
  run("DELETE FROM panonav.routes WHERE memory = $1 AND name = $2", name);
}

std::vector<std::string> PostgresqlTables::route_names() {
  return query_texts("SELECT name FROM panonav.routes WHERE memory = $1 ORDER BY name");
}

void PostgresqlTables::write_block(std::string_view route, std::int64_t number,
                                   std::span<const std::uint8_t> lines, std::int64_t checksum) {
  connection_.run(
      "INSERT INTO panonav.route_blocks(memory, route, number, lines, checksum) VALUES ($1, $2, "
      "$3, "
      "$4, $5) ON CONFLICT (memory, route, number) DO UPDATE SET lines = excluded.lines, checksum "
      "= "
      "excluded.checksum",
      Values().add(memory_).add(route).add(number).add(lines).add(checksum));
}

std::optional<StoredBytes> PostgresqlTables::block(std::string_view route, std::int64_t number) {
  const Rows rows = connection_.run(
      "SELECT lines, checksum FROM panonav.route_blocks WHERE memory = $1 AND route = $2 AND "
      "number = $3",
      Values().add(memory_).add(route).add(number));
  if (rows.size() == 0) return std::nullopt;
  return StoredBytes{rows.copy(0, 0), rows.integer(0, 1)};
}

std::int64_t PostgresqlTables::block_count(std::string_view route) {
  return run("SELECT count(*) FROM panonav.route_blocks WHERE memory = $1 AND route = $2", route)
      .integer(0, 0);
}

std::int64_t PostgresqlTables::route_bytes(std::string_view route) {
  return run("SELECT coalesce(sum(length(lines)), 0)::int8 FROM panonav.route_blocks WHERE memory "
             "= "
             "$1 AND route = $2",
             route)
      .integer(0, 0);
}

std::vector<std::string> PostgresqlTables::list_routes_with_blocks() {
  return query_texts("SELECT DISTINCT route FROM panonav.route_blocks WHERE memory = $1");
}

void PostgresqlTables::run_undoably(const std::function<void()>& changes, const std::string& what) {
  run("DELETE FROM panonav.undo_rows WHERE memory = $1");
  connection_.execute("SELECT set_config('panonav.undo', 'on', true)");
  changes();
  connection_.execute("SELECT set_config('panonav.undo', '', true)");
  require_undo_bytes(path(), run("SELECT coalesce(sum(coalesce(length(before), 0) + "
                                 "coalesce(length(after), 0)), 0)::int8 FROM panonav.undo_rows "
                                 "WHERE memory = $1")
                                 .integer(0, 0));
  run("INSERT INTO panonav.undo(memory, what) VALUES ($1, $2) ON CONFLICT (memory) DO UPDATE SET "
      "what = excluded.what",
      what);
}

std::vector<MemoryFile::KeptChange> PostgresqlTables::history() {
  const Rows rows = run(
      "SELECT what, (SELECT coalesce(sum(coalesce(length(before), 0) + coalesce(length(after), "
      "0)), 0)::int8 FROM panonav.undo_rows WHERE memory = $1) FROM panonav.undo WHERE memory = "
      "$1");
  if (rows.size() == 0) return {};
  return {{std::string(rows.text(0, 0)), std::nullopt,
           static_cast<std::uint64_t>(rows.integer(0, 1)), true}};
}

void PostgresqlTables::undo() {
  const auto kept = history();
  const std::string what = kept.empty() ? "" : kept.front().what;
  const Rows rows = run("SELECT panonav.undo($1)");
  if (!rows.is_null(0, 0)) {
    throw_undo_conflict(path(), what, rows.text(0, 0));
  }
}

// Checks only ids and rows, because the server itself manages its pages.
std::set<ViewId> PostgresqlTables::verify_structure(const Check& check) {
  std::set<ViewId> views;
  check([&] { static_cast<void>(last_id()); });
  check([&] {
    const std::vector<ViewId> all = this->views();
    views.insert(all.begin(), all.end());
  });
  return views;
}

std::vector<MemoryFile::ViewPlace> PostgresqlTables::places() {
  std::vector<MemoryFile::ViewPlace> places;
  const Rows rows = connection_.run(
      "SELECT id, name, x_m, y_m, heading_rad FROM panonav.views WHERE memory = $1 ORDER BY id",
      Values().add(memory_));
  for (int i = 0; i < rows.size(); ++i) {
    auto& place = places.emplace_back(MemoryFile::ViewPlace{
        read_view_id(rows, i, 0), std::string(floor_of(rows.text(i, 1))), {}});
    const auto x_m = rows.real(i, 2);
    const auto y_m = rows.real(i, 3);
    if (x_m && y_m) place.pose = ReferencePose{*x_m, *y_m, rows.real(i, 4)};
  }
  return places;
}

MemoryFile::Info PostgresqlTables::info() {
  const Rows rows =
      run("SELECT (SELECT count(*) FROM panonav.views WHERE memory = $1),"
          "(SELECT count(x_m) FROM panonav.views WHERE memory = $1),"
          "(SELECT count(heading_rad) FROM panonav.views WHERE memory = $1),"
          "(SELECT count(*) FROM panonav.links WHERE memory = $1),"
          "(SELECT count(*) FROM panonav.thumbnails WHERE memory = $1),"
          "(SELECT count(*) FROM panonav.features WHERE memory = $1),"
          "(SELECT coalesce(sum(length(bytes)), 0)::int8 FROM panonav.features WHERE memory = $1),"
          "(SELECT count(*) FROM panonav.maps WHERE memory = $1),"
          "(SELECT count(*) FROM panonav.routes WHERE memory = $1),"
          "(SELECT coalesce(sum(pg_column_size(v.*)), 0) FROM panonav.views v WHERE memory = $1) + "
          "(SELECT coalesce(sum(length(bytes)), 0) FROM panonav.thumbnails WHERE memory = $1) + "
          "(SELECT coalesce(sum(pg_column_size(m.*)), 0) FROM panonav.maps m WHERE memory = $1) + "
          "(SELECT coalesce(sum(pg_column_size(l.*)), 0) FROM panonav.links l WHERE memory = $1) + "
          "(SELECT coalesce(sum(length(lines)), 0) FROM panonav.route_blocks WHERE memory = $1)");
  const auto count = [&](int column) {
    return static_cast<std::uint64_t>(rows.integer(0, column));
  };
  MemoryFile::Info info;
  info.views = count(0);
  info.views_with_position = count(1);
  info.views_with_heading = count(2);
  info.links = count(3);
  info.thumbnails = count(4);
  info.views_with_features = count(5);
  info.feature_bytes = count(6);
  info.maps = count(7);
  info.routes = count(8);
  info.format_version = memory_format_version;
  info.file_bytes = count(9) + info.feature_bytes;
  return info;
}

}  // namespace panonav::fleet
