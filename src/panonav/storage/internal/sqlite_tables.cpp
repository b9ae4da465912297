#include "panonav/storage/internal/sqlite_tables.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/memory_schema.hpp"
#include "panonav/storage/internal/synchronised_tables.hpp"

namespace panonav {

namespace {

std::optional<double> optional_real(const Statement& row, int column) {
  if (row.is_null(column)) return std::nullopt;
  return row.real(column);
}

// Binds name, x_m, y_m, heading_rad and stamp_s to the parameters from `first` on.
void bind_info(Statement& statement, int first, const ReferenceInfo& info) {
  const auto& pose = info.pose;
  statement.bind(first, info.name)
      .bind(first + 1, pose ? std::optional(pose->x_m) : std::nullopt)
      .bind(first + 2, pose ? std::optional(pose->y_m) : std::nullopt)
      .bind(first + 3, pose ? pose->heading_rad : std::nullopt)
      .bind(first + 4, info.stamp_s);
}

std::vector<std::uint8_t> copy_bytes(std::span<const std::uint8_t> bytes) {
  return {bytes.begin(), bytes.end()};
}

}  // namespace

SqliteTables::SqliteTables(std::filesystem::path path, Database database)
    : path_(std::move(path)),
      database_(std::move(database)),
      insert_view_(database_,
                   "INSERT INTO views(id, name, x_m, y_m, heading_rad, stamp_s, signature, "
                   "checksum) VALUES(?, ?, ?, ?, ?, ?, ?, ?)"),
      find_name_(database_, "SELECT id FROM views WHERE name = ?"),
      find_view_(database_,
                 "SELECT id, name, x_m, y_m, heading_rad, stamp_s, signature, checksum FROM views "
                 "WHERE id = ?") {}

std::unique_ptr<MemoryTables::Transaction> SqliteTables::transaction(Kind kind) {
  return std::make_unique<DatabaseTransaction>(database_, kind);
}

ViewId SqliteTables::read_view_id(const Statement& row, int column) const {
  return to_view_id(row.integer(column));
}

ViewRow SqliteTables::read_view_row(const Statement& row) const {
  ViewRow view;
  view.id = read_view_id(row, 0);
  view.info.name = row.text(1);
  const auto x_m = optional_real(row, 2);
  const auto y_m = optional_real(row, 3);
  if (x_m && y_m) view.info.pose = ReferencePose{*x_m, *y_m, optional_real(row, 4)};
  view.info.stamp_s = optional_real(row, 5);
  view.signature = row.blob(6);
  view.checksum = row.integer(7);
  return view;
}

std::vector<std::string> SqliteTables::query_texts(const char* sql) {
  std::vector<std::string> texts;
  Statement rows(database_, sql);
  while (rows.step()) texts.emplace_back(rows.text(0));
  return texts;
}

Settings SqliteTables::settings() {
  return read_settings(database_);
}

void SqliteTables::write_setting(const std::string& key, const SettingValue& value) {
  panonav::write_setting(database_, key, value);
}

void SqliteTables::erase_setting(const std::string& key) {
  run_statement(database_, "DELETE FROM settings WHERE key = ?", key);
}

std::uint32_t SqliteTables::last_id() {
  // SQLite stores the last id in a table without types, which can contain anything.
  Statement rows(database_, "SELECT name, seq FROM sqlite_sequence");
  std::int64_t last = 0;
  for (int count = 0; rows.step(); ++count) {
    if (rows.text(0) != "views" || count > 0) {
      fail_damaged("table sqlite_sequence holds more than the last view id");
    }
    last = rows.integer(1);
  }
  Statement largest(database_, "SELECT id FROM views ORDER BY id DESC LIMIT 1");
  const std::int64_t id = largest.step() ? largest.integer(0) : 0;
  largest.reset();
  if (last < 0 || last >= std::int64_t{UINT32_MAX} || id > last) {
    fail_damaged("the last view id is " + std::to_string(last) + ", the largest " +
                 std::to_string(id) + "; allowed: 0 .. 2^32 - 2, not below the largest");
  }
  return static_cast<std::uint32_t>(last);
}

void SqliteTables::insert(std::span<const ViewId> ids, std::span<const NewView> views) {
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ViewId id = ids[i];
    const NewView& view = views[i];
    pack_signature(view.signature, signature_);
    insert_view_.bind(1, id);
    bind_info(insert_view_, 2, view.info);
    insert_view_.bind(7, signature_).bind(8, view_checksum(scratch_, id, view.info, signature_));
    const int constraint = insert_view_.run();
    if (constraint == SQLITE_CONSTRAINT_UNIQUE) throw_used_name("view", view.info.name, path_);
    if (constraint != 0) fail_damaged("the id of a new view is taken");
  }
  for (const ViewAttachment table : {ViewAttachment::thumbnails, ViewAttachment::features}) {
    insert_attachments(table, ids, views);
  }
}

void SqliteTables::require_views(std::span<const ViewId> views) {
  Statement statement(database_, "SELECT 1 FROM views WHERE id = ?");
  for (const ViewId view : views) {
    if (!statement.bind(1, view).step()) fail_missing_view(view);
    statement.reset();
  }
}

void SqliteTables::fail_missing_view(ViewId view) {
  // A damaged table can list a view that a search for its id does not find, and the index of the
  // names, which is on other pages, still has rows that the table has lost.
  Statement listed(database_,
                   "SELECT 1 FROM views NOT INDEXED WHERE +id = ?1 UNION ALL "
                   "SELECT 1 FROM views INDEXED BY sqlite_autoindex_views_1 WHERE id = ?1",
                   view);
  if (!listed.step()) throw_unknown_view(view);
  fail_damaged("view " + std::to_string(view.value) + " is missing");
}

void SqliteTables::remove(std::span<const ViewId> views) {
  std::vector<Statement> statements;
  for (const char* sql : {"DELETE FROM links WHERE a = ?1 OR b = ?1",
                          "DELETE FROM thumbnails WHERE part BETWEEN 256 * ?1 AND 256 * ?1 + 255",
                          "DELETE FROM features WHERE part BETWEEN 256 * ?1 AND 256 * ?1 + 255",
                          "DELETE FROM views WHERE id = ?"}) {
    statements.emplace_back(database_, sql);
  }
  for (const ViewId view : views) {
    for (Statement& statement : statements) statement.bind(1, view).run();
  }
}

void SqliteTables::write_info(ViewId view, const ReferenceInfo& info, std::int64_t checksum) {
  Statement write(database_,
                  "UPDATE views SET name = ?, x_m = ?, y_m = ?, heading_rad = ?, stamp_s = ?, "
                  "checksum = ? WHERE id = ?");
  bind_info(write, 1, info);
  write.bind(6, checksum).bind(7, view);
  if (write.run() != 0) throw_used_name("view", info.name, path_);
}

void SqliteTables::read_views(const RowCallback<ViewRow>& consume) {
  std::int64_t read = 0;
  Statement rows(database_,
                 "SELECT id, name, x_m, y_m, heading_rad, stamp_s, signature, checksum FROM views "
                 "ORDER BY id");
  for (; rows.step(); ++read) consume(read_view_row(rows));
  // A damaged page can lose views without any other error; the index of the names, on other pages,
  // still counts them.
  const std::int64_t count = database_.integer(
      "SELECT count(*) FROM views INDEXED BY sqlite_autoindex_views_1 WHERE name > ''");
  if (count != read) {
    fail_damaged("it holds " + std::to_string(read) + " of " + std::to_string(count) + " views");
  }
}

void SqliteTables::read_views(std::span<const ViewId> views, const RowCallback<ViewRow>& consume) {
  for (const ViewId view : views) {
    find_view_.reset();  // an earlier `consume` may have thrown
    if (!find_view_.bind(1, view).step()) fail_missing_view(view);
    consume(read_view_row(find_view_));
  }
  find_view_.reset();
}

void SqliteTables::read_available_views(std::span<const ViewId> views,
                                        const RowCallback<ViewRow>& consume) {
  for (const ViewId view : views) {
    find_view_.reset();
    if (find_view_.bind(1, view).step()) consume(read_view_row(find_view_));
  }
  find_view_.reset();
}

void SqliteTables::read_magnitudes(ViewId first, ViewId last, std::size_t bytes,
                                   const RowCallback<MagnitudesRow>& consume) {
  Statement rows(database_,
                 "SELECT id, x_m, y_m, signature FROM views WHERE id BETWEEN ? AND ? ORDER BY id",
                 first, last);
  while (rows.step()) {
    const auto x_m = optional_real(rows, 1);
    const auto y_m = optional_real(rows, 2);
    const auto signature = rows.blob(3);
    consume({read_view_id(rows, 0), x_m && y_m ? std::optional(Point2{*x_m, *y_m}) : std::nullopt,
             signature.first(std::min(bytes, signature.size()))});
  }
}

std::optional<ViewId> SqliteTables::find(std::string_view name) {
  std::optional<ViewId> found;
  if (find_name_.bind(1, name).step()) found = read_view_id(find_name_, 0);
  find_name_.reset();
  return found;
}

void SqliteTables::write_links(std::span<const Link> links) {
  Statement insert(database_,
                   "INSERT INTO links(a, b, kind, checksum) VALUES(?, ?, ?, ?) ON CONFLICT(a, b) "
                   "DO UPDATE SET kind = excluded.kind, checksum = excluded.checksum");
  for (const Link& link : links) {
    insert.bind_all(link.a, link.b, static_cast<std::int64_t>(link.kind), link_checksum(link))
        .run();
  }
}

void SqliteTables::erase_link(ViewId a, ViewId b) {
  run_statement(database_, "DELETE FROM links WHERE a = ? AND b = ?", a, b);
}

void SqliteTables::read_links(const RowCallback<LinkRow>& consume) {
  Statement check(database_, "PRAGMA quick_check(links)");
  if (!check.step() || check.text(0) != "ok") fail_damaged("table links");
  check.reset();
  Statement rows(database_, "SELECT a, b, kind, checksum FROM links ORDER BY a, b");
  while (rows.step())
    consume({read_view_id(rows, 0), read_view_id(rows, 1), rows.integer(2), rows.integer(3)});
}

void SqliteTables::write_map(std::string_view name, const MapRow& row) {
  const char* const sql =
      "INSERT INTO maps(name, nodes, edges, checksum) VALUES(?, ?, ?, ?) ON CONFLICT(name) DO "
      "UPDATE SET nodes = excluded.nodes, edges = excluded.edges, checksum = excluded.checksum";
  if (run_statement(database_, sql, name, row.nodes, row.edges, row.checksum) != 0) {
    fail_damaged("map " + std::string(name) + ": cannot be replaced");
  }
}

std::optional<MapRow> SqliteTables::map(std::string_view name) {
  Statement row(database_, "SELECT nodes, edges, checksum FROM maps WHERE name = ?", name);
  if (!row.step()) return std::nullopt;
  return MapRow{copy_bytes(row.blob(0)), copy_bytes(row.blob(1)), row.integer(2)};
}

void SqliteTables::erase_map(std::string_view name) {
  run_statement(database_, "DELETE FROM maps WHERE name = ?", name);
}

std::vector<std::string> SqliteTables::map_names() {
  return query_texts("SELECT name FROM maps ORDER BY name");
}

void SqliteTables::write_route(std::string_view name, const RouteRow& row) {
  const char* const sql =
      "INSERT INTO routes(name, columns, lines, checksum) VALUES(?, ?, ?, ?) ON CONFLICT(name) DO "
      "UPDATE SET lines = excluded.lines, checksum = excluded.checksum";
  if (run_statement(database_, sql, name, row.columns, row.lines, row.checksum) != 0) {
    fail_damaged("route " + std::string(name) + ": cannot be written");
  }
}

std::optional<RouteRow> SqliteTables::route(std::string_view name) {
  Statement row(database_, "SELECT columns, lines, checksum FROM routes WHERE name = ?", name);
  if (!row.step()) return std::nullopt;
  return RouteRow{row.integer(0), row.integer(1), row.integer(2)};
}

void SqliteTables::erase_route(std::string_view name) {
  run_statement(database_, "DELETE FROM route_blocks WHERE route = ?", name);
  run_statement(database_, "DELETE FROM routes WHERE name = ?", name);
}

std::vector<std::string> SqliteTables::route_names() {
  return query_texts("SELECT name FROM routes ORDER BY name");
}

void SqliteTables::write_block(std::string_view route, std::int64_t number,
                               std::span<const std::uint8_t> lines, std::int64_t checksum) {
  const char* const sql =
      "INSERT INTO route_blocks(route, number, lines, checksum) VALUES(?, ?, ?, ?) ON "
      "CONFLICT(route, number) DO UPDATE SET lines = excluded.lines, checksum = excluded.checksum";
  if (run_statement(database_, sql, route, number, lines, checksum) != 0) {
    fail_damaged("route " + std::string(route) + ": a block cannot be written");
  }
}

std::optional<StoredBytes> SqliteTables::block(std::string_view route, std::int64_t number) {
  Statement rows(database_,
                 "SELECT lines, checksum FROM route_blocks WHERE route = ? AND number = ?", route,
                 number);
  if (!rows.step()) return std::nullopt;
  return StoredBytes{copy_bytes(rows.blob(0)), rows.integer(1)};
}

std::int64_t SqliteTables::block_count(std::string_view route) {
  Statement count(database_, "SELECT count(*) FROM route_blocks WHERE route = ?", route);
  return count.step() ? count.integer(0) : 0;
}

std::int64_t SqliteTables::route_bytes(std::string_view route) {
  Statement sum(database_,
                "SELECT coalesce(sum(length(lines)), 0) FROM route_blocks WHERE route = ?", route);
  return sum.step() ? sum.integer(0) : 0;
}

std::vector<std::string> SqliteTables::list_routes_with_blocks() {
  return query_texts("SELECT DISTINCT route FROM route_blocks");
}

std::set<ViewId> SqliteTables::verify_structure(const Check& check) {
  bool intact = true;
  // The full check counts the entries of indexes, which never ends if pages refer to each other;
  // the quick check finds such pages first.
  for (const char* sql : {"PRAGMA quick_check", "PRAGMA integrity_check"}) {
    if (!intact) break;
    intact = false;
    check([&] {
      std::vector<std::string> lines = query_texts(sql);
      intact = lines == std::vector<std::string>{"ok"};
      for (std::string& line : lines) {
        std::ranges::replace(line, '\n', ' ');
        if (line != "ok") check([&] { fail_damaged(line); });
      }
    });
  }
  check([&] { static_cast<void>(last_id()); });
  check([&] { static_cast<void>(read_synchronised_views(*this)); });
  check([&] { static_cast<void>(read_synchronised_links(*this)); });
  // Ids in the table and in the index of names, so that a view that one of them has lost is found
  // in the other.
  std::set<ViewId> views;
  for (const char* sql : {"SELECT id FROM views NOT INDEXED ORDER BY id",
                          "SELECT id FROM views INDEXED BY sqlite_autoindex_views_1"}) {
    check([&] {
      Statement ids(database_, sql);
      while (ids.step()) views.insert(read_view_id(ids, 0));
    });
  }
  return views;
}

}  // namespace panonav
