#include "panonav/storage/internal/route_tables.hpp"

#include <algorithm>
#include <set>
#include <span>

#include "panonav/core/error.hpp"
#include "panonav/storage/checksum.hpp"
#include "panonav/storage/internal/route_lines.hpp"

namespace panonav {

namespace {

// Lines of a full block. Many, so that what SQLite adds to a block is small beside it; not more, as
// the last block is written anew with every append.
constexpr std::int64_t lines_of_block = 256;

struct RouteRow {
  int columns = 0;
  std::int64_t lines = 0;

  [[nodiscard]] std::int64_t checksum_of(std::string_view name) const {
    RecordBytes record;
    record.add(name);
    record.add(std::int64_t{columns});
    record.add(lines);
    return static_cast<std::int64_t>(checksum(record.bytes()));
  }
  [[nodiscard]] std::int64_t blocks() const { return (lines - 1) / lines_of_block + 1; }
  // Lines of block `number`: all are full but the last.
  [[nodiscard]] std::int64_t lines_of(std::int64_t number) const {
    return std::min(lines_of_block, lines - number * lines_of_block);
  }
};

std::int64_t block_checksum(std::string_view name, std::int64_t number,
                            std::span<const std::uint8_t> lines) {
  RecordBytes record;
  record.add(name);
  record.add(number);
  return static_cast<std::int64_t>(checksum(lines, checksum(record.bytes())));
}

[[noreturn]] void fail_route(const Database& database, std::string_view name,
                             const std::string& what) {
  database.fail_damaged("route " + std::string(name) + ": " + what);
}

std::optional<RouteRow> read_row(Database& database, std::string_view name) {
  Statement row(database, "SELECT columns, lines, checksum FROM routes WHERE name = ?");
  if (!row.bind(1, name).step()) return std::nullopt;
  constexpr std::int64_t max_columns = 16384;
  const std::int64_t columns = row.integer(0);
  if (columns < 16 || columns > max_columns) {
    fail_route(database, name, "columns are " + std::to_string(columns) + "; allowed: 16 to 16384");
  }
  const RouteRow route{static_cast<int>(columns), row.integer(1)};
  if (route.lines < 1 || row.integer(2) != route.checksum_of(name)) {
    fail_route(database, name, "does not match its checksum");
  }
  // Its last block must be there: a count that the file has no room for is found at once.
  Statement last(database, "SELECT 1 FROM route_blocks WHERE route = ? AND number = ?");
  if (!last.bind(1, name).bind(2, route.blocks() - 1).step()) {
    fail_route(database, name,
               "its last block of " + std::to_string(route.blocks()) + " is missing");
  }
  return route;
}

// Replaces the block of that number.
void write_block(Database& database, std::string_view name, std::int64_t number,
                 std::span<const std::uint8_t> lines) {
  Statement insert(database,
                   "INSERT INTO route_blocks(route, number, lines, checksum) VALUES(?, ?, ?, ?) ON "
                   "CONFLICT(route, number) DO UPDATE SET lines = excluded.lines, checksum = "
                   "excluded.checksum");
  insert.bind(1, name).bind(2, number).bind(3, lines).bind(4, block_checksum(name, number, lines));
  if (insert.run() != 0) fail_route(database, name, "a block cannot be written");
}

void write_row(Database& database, std::string_view name, const RouteRow& row) {
  Statement head(database,
                 "INSERT INTO routes(name, columns, lines, checksum) VALUES(?, ?, ?, ?) ON "
                 "CONFLICT(name) DO UPDATE SET lines = excluded.lines, checksum = "
                 "excluded.checksum");
  head.bind(1, name)
      .bind(2, std::int64_t{row.columns})
      .bind(3, row.lines)
      .bind(4, row.checksum_of(name));
  if (head.run() != 0) fail_route(database, name, "cannot be written");
}

// Passes the packed lines of block `number` to `use`, checked.
template <class Use>
void with_block(Database& database, std::string_view name, std::int64_t number, const Use& use) {
  const std::string block = "block " + std::to_string(number);
  Statement rows(database,
                 "SELECT lines, checksum FROM route_blocks WHERE route = ? AND number = ?");
  if (!rows.bind(1, name).bind(2, number).step()) {
    fail_route(database, name, block + " is missing");
  }
  const auto bytes = rows.blob(0);
  if (rows.integer(1) != block_checksum(name, number, bytes)) {
    fail_route(database, name, block + " does not match its checksum");
  }
  use(bytes);
}

// Appends the lines of block `number` to `route`.
void read_block(Database& database, std::string_view name, const RouteRow& row, std::int64_t number,
                RoutePanorama& route) {
  with_block(database, name, number, [&](std::span<const std::uint8_t> bytes) {
    if (!unpack_route_lines(bytes, static_cast<std::size_t>(row.lines_of(number)), route)) {
      fail_route(database, name, "block " + std::to_string(number) + " cannot be unpacked");
    }
  });
}

}  // namespace

std::size_t append_to_route(Database& database, std::string_view name, const RoutePanorama& more) {
  if (name.empty()) throw ContractError("name of a route", "empty", "at least one character");
  if (more.empty()) throw ContractError("lines of the route", 0, "1 or more");
  RouteRow row = read_row(database, name).value_or(RouteRow{more.columns(), 0});
  if (row.columns != more.columns()) {
    throw ContractError("columns", more.columns(),
                        std::to_string(row.columns) + ", as in the route " + std::string(name));
  }
  // The last block is taken up again: as it is when it is full, to see the last line.
  std::int64_t number = std::max<std::int64_t>(0, row.blocks() - 1);
  RoutePanorama open(row.columns);
  if (row.lines > 0) read_block(database, name, row, number, open);
  const std::size_t known = open.size();
  for (std::size_t i = 0; i < more.size(); ++i) {
    static_cast<void>(open.append(more.poses()[i], more.line(i)));
  }
  const std::size_t appended = open.size() - known;
  if (appended == 0) return 0;

  constexpr auto full = static_cast<std::size_t>(lines_of_block);
  for (std::size_t first = known == full ? full : 0; first < open.size(); first += full) {
    const auto bytes = pack_route_lines(open, first, std::min(full, open.size() - first));
    const std::int64_t block = number + static_cast<std::int64_t>(first / full);
    write_block(database, name, block, bytes);
  }
  row.lines += static_cast<std::int64_t>(appended);
  write_row(database, name, row);
  return appended;
}

std::optional<RoutePanorama> read_route(Database& database, std::string_view name) {
  const auto row = read_row(database, name);
  Statement count(database, "SELECT count(*) FROM route_blocks WHERE route = ?");
  const std::int64_t blocks = count.bind(1, name).step() ? count.integer(0) : 0;
  count.reset();
  if (!row) {
    if (blocks > 0) fail_route(database, name, "blocks without the route");
    return std::nullopt;
  }
  if (blocks != row->blocks()) {
    fail_route(
        database, name,
        "it holds " + std::to_string(blocks) + " of " + std::to_string(row->blocks()) + " blocks");
  }
  RoutePanorama route(row->columns);
  for (std::int64_t number = 0; number < blocks; ++number) {
    read_block(database, name, *row, number, route);
  }
  return route;
}

std::size_t route_bytes(Database& database, std::string_view name) {
  Statement sum(database,
                "SELECT coalesce(sum(length(lines)), 0) FROM route_blocks WHERE route = ?");
  return sum.bind(1, name).step() ? static_cast<std::size_t>(sum.integer(0)) : 0;
}

void rename_route(Database& database, std::string_view name, std::string_view new_name) {
  const auto row = read_row(database, name);
  if (!row) fail_route(database, name, "is missing");
  for (std::int64_t number = 0; number < row->blocks(); ++number) {
    with_block(database, name, number, [&](std::span<const std::uint8_t> bytes) {
      write_block(database, new_name, number, bytes);
    });
  }
  write_row(database, new_name, *row);
  erase_route(database, name);
}

bool erase_route(Database& database, std::string_view name) {
  const bool there = read_row(database, name).has_value();
  for (const char* sql :
       {"DELETE FROM route_blocks WHERE route = ?", "DELETE FROM routes WHERE name = ?"}) {
    Statement erase(database, sql);
    static_cast<void>(erase.bind(1, name).run());
  }
  return there;
}

std::vector<std::string> route_names(Database& database) {
  std::vector<std::string> names;
  Statement rows(database, "SELECT name FROM routes ORDER BY name");
  while (rows.step()) names.emplace_back(rows.text(0));
  return names;
}

void verify_routes(Database& database,
                   const std::function<void(const std::function<void()>&)>& check) {
  // From both tables: a route that either has lost is found in the other.
  std::set<std::string> names;
  for (const char* sql : {"SELECT name FROM routes", "SELECT DISTINCT route FROM route_blocks"}) {
    check([&] {
      Statement rows(database, sql);
      while (rows.step()) names.emplace(rows.text(0));
    });
  }
  for (const auto& name : names) {
    check([&] { static_cast<void>(read_route(database, name)); });
  }
}

}  // namespace panonav
