#include "panonav/storage/internal/route_tables.hpp"

#include <algorithm>
#include <set>
#include <span>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/checksum.hpp"
#include "panonav/storage/internal/route_lines.hpp"

namespace panonav {

namespace {

// Lines of a full block. A larger number has less overhead of SQLite for each block; a smaller one
// writes less with each append, which replaces the last block.
constexpr std::int64_t lines_per_block = 256;

std::int64_t compute_row_checksum(std::string_view name, const RouteRow& row) {
  RecordBytes record;
  record.add(name);
  record.add(row.columns);
  record.add(row.lines);
  return static_cast<std::int64_t>(checksum(record.bytes()));
}

// A chain of snapshots has no columns, its nodes as lines, and its packed form as the only block.
constexpr std::int64_t chain_columns = 0;

bool is_chain(const RouteRow& row) {
  return row.columns == chain_columns;
}

std::int64_t count_blocks(const RouteRow& row) {
  return is_chain(row) ? 1 : (row.lines - 1) / lines_per_block + 1;
}

// Returns the number of lines of block `number`; all blocks but the last are full.
std::int64_t count_lines(const RouteRow& row, std::int64_t number) {
  return std::min(lines_per_block, row.lines - number * lines_per_block);
}

std::int64_t compute_block_checksum(std::string_view name, std::int64_t number,
                                    std::span<const std::uint8_t> lines) {
  RecordBytes record;
  record.add(name);
  record.add(number);
  return static_cast<std::int64_t>(checksum(lines, checksum(record.bytes())));
}

[[noreturn]] void fail_route(const MemoryTables& tables, std::string_view name,
                             const std::string& what) {
  tables.fail_damaged("route " + std::string(name) + ": " + what);
}

std::optional<RouteRow> read_row(MemoryTables& tables, std::string_view name) {
  const auto row = tables.route(name);
  if (!row) return std::nullopt;
  constexpr std::int64_t max_columns = 16384;
  if (!is_chain(*row) && (row->columns < 16 || row->columns > max_columns)) {
    fail_route(tables, name,
               "columns are " + std::to_string(row->columns) +
                   "; allowed: 16 to 16384, or 0 for a chain of snapshots");
  }
  if (row->lines < 1 || row->checksum != compute_row_checksum(name, *row)) {
    fail_route(tables, name, "does not match its checksum");
  }
  // The last block must exist, so that an impossible number of lines is found at once.
  if (!tables.block(name, count_blocks(*row) - 1)) {
    fail_route(tables, name,
               "its last block of " + std::to_string(count_blocks(*row)) + " is missing");
  }
  return row;
}

// Writes or replaces the block of that number.
void write_block(MemoryTables& tables, std::string_view name, std::int64_t number,
                 std::span<const std::uint8_t> lines) {
  tables.write_block(name, number, lines, compute_block_checksum(name, number, lines));
}

void write_row(MemoryTables& tables, std::string_view name, RouteRow row) {
  row.checksum = compute_row_checksum(name, row);
  tables.write_route(name, row);
}

// Returns the packed lines of block `number`, after checking them.
std::vector<std::uint8_t> read_block(MemoryTables& tables, std::string_view name,
                                     std::int64_t number) {
  const std::string block = "block " + std::to_string(number);
  auto stored = tables.block(name, number);
  if (!stored) fail_route(tables, name, block + " is missing");
  if (stored->checksum != compute_block_checksum(name, number, stored->bytes)) {
    fail_route(tables, name, block + " does not match its checksum");
  }
  return std::move(stored->bytes);
}

// Returns the row of a route whose blocks are all there; nullopt if there is no such route.
std::optional<RouteRow> read_complete_row(MemoryTables& tables, std::string_view name) {
  const auto row = read_row(tables, name);
  const std::int64_t block_count = tables.block_count(name);
  if (!row) {
    if (block_count > 0) fail_route(tables, name, "blocks without the route");
    return std::nullopt;
  }
  if (block_count != count_blocks(*row)) {
    fail_route(tables, name,
               "it holds " + std::to_string(block_count) + " of " +
                   std::to_string(count_blocks(*row)) + " blocks");
  }
  return row;
}

// Throws FileError on a route that was recorded by the other method.
void require_method(const MemoryTables& tables, std::string_view name, const RouteRow& row,
                    RouteMethod method) {
  if (is_chain(row) == (method == RouteMethod::chain)) return;
  const auto describe = [](bool chain) {
    return chain ? "a chain of snapshots" : "a route panorama";
  };
  throw FileError(tables.message_path().string(),
                  "route '" + std::string(name) + "' is " + describe(is_chain(row)) +
                      "; allowed here: " + describe(!is_chain(row)) + ", or another name");
}

// Returns the chain of a packed form. Throws DamageError on bytes that `SnapshotChain::pack` does
// not write, or another number of nodes.
SnapshotChain unpack_chain(const MemoryTables& tables, std::string_view name, const RouteRow& row,
                           std::span<const std::uint8_t> packed) {
  std::optional<SnapshotChain> chain;
  try {
    chain = SnapshotChain::unpack(packed);
  } catch (const ContractError& error) {
    fail_route(tables, name, error.what());
  }
  const auto nodes = static_cast<std::int64_t>(chain->nodes().size());
  if (nodes != row.lines) {
    fail_route(tables, name,
               "nodes are " + std::to_string(row.lines) + "; allowed: " + std::to_string(nodes) +
                   ", as in its packed form");
  }
  return *std::move(chain);
}

// Appends the lines of block `number` to `route`.
void read_block(MemoryTables& tables, std::string_view name, const RouteRow& row,
                std::int64_t number, RoutePanorama& route) {
  if (!unpack_route_lines(read_block(tables, name, number),
                          static_cast<std::size_t>(count_lines(row, number)), route)) {
    fail_route(tables, name, "block " + std::to_string(number) + " cannot be unpacked");
  }
}

}  // namespace

std::size_t append_to_route(MemoryTables& tables, std::string_view name,
                            const RoutePanorama& more) {
  if (name.empty()) throw ContractError("name of a route", "empty", "at least one character");
  if (more.empty()) throw ContractError("lines of the route", 0, "1 or more");
  RouteRow row = read_row(tables, name).value_or(RouteRow{more.columns(), 0, 0});
  require_method(tables, name, row, RouteMethod::panorama);
  if (row.columns != more.columns()) {
    throw ContractError("columns", more.columns(),
                        std::to_string(row.columns) + ", as in the route " + std::string(name));
  }
  // Reads the last block to add lines to it; if it is full, only to compare with its last line.
  std::int64_t number = std::max<std::int64_t>(0, count_blocks(row) - 1);
  RoutePanorama open(static_cast<int>(row.columns));
  if (row.lines > 0) read_block(tables, name, row, number, open);
  const std::size_t known = open.size();
  for (std::size_t i = 0; i < more.size(); ++i) {
    static_cast<void>(open.append(more.poses()[i], more.line(i)));
  }
  const std::size_t appended = open.size() - known;
  if (appended == 0) return 0;

  constexpr auto full = static_cast<std::size_t>(lines_per_block);
  for (std::size_t first = known == full ? full : 0; first < open.size(); first += full) {
    const auto bytes = pack_route_lines(open, first, std::min(full, open.size() - first));
    const std::int64_t block = number + static_cast<std::int64_t>(first / full);
    write_block(tables, name, block, bytes);
  }
  row.lines += static_cast<std::int64_t>(appended);
  write_row(tables, name, row);
  return appended;
}

std::optional<RoutePanorama> read_route(MemoryTables& tables, std::string_view name) {
  const auto row = read_complete_row(tables, name);
  if (!row) return std::nullopt;
  require_method(tables, name, *row, RouteMethod::panorama);
  RoutePanorama route(static_cast<int>(row->columns));
  for (std::int64_t number = 0; number < count_blocks(*row); ++number) {
    read_block(tables, name, *row, number, route);
  }
  return route;
}

void write_chain(MemoryTables& tables, std::string_view name, const SnapshotChain& chain) {
  if (name.empty()) throw ContractError("name of a route", "empty", "at least one character");
  if (tables.route(name)) {
    throw ContractError("name of a chain", std::string(name), "a name of no route");
  }
  const RouteRow row{chain_columns, static_cast<std::int64_t>(chain.nodes().size()), 0};
  const std::vector<std::uint8_t> packed = chain.pack();
  static_cast<void>(unpack_chain(tables, name, row, packed));
  write_block(tables, name, 0, packed);
  write_row(tables, name, row);
}

std::optional<SnapshotChain> read_chain(MemoryTables& tables, std::string_view name) {
  const auto row = read_complete_row(tables, name);
  if (!row) return std::nullopt;
  require_method(tables, name, *row, RouteMethod::chain);
  return unpack_chain(tables, name, *row, read_block(tables, name, 0));
}

std::optional<RouteMethod> read_route_method(MemoryTables& tables, std::string_view name) {
  const auto row = read_row(tables, name);
  if (!row) return std::nullopt;
  return is_chain(*row) ? RouteMethod::chain : RouteMethod::panorama;
}

std::set<std::string> list_stored_routes(MemoryTables& tables) {
  std::set<std::string> names;
  for (const auto& found : {tables.route_names(), tables.list_routes_with_blocks()}) {
    names.insert(found.begin(), found.end());
  }
  return names;
}

void copy_route(MemoryTables& from, MemoryTables& to, std::string_view name) {
  if (read_route_method(from, name) == RouteMethod::chain) {
    write_chain(to, name, read_chain(from, name).value());
  } else {
    append_to_route(to, name, read_route(from, name).value());
  }
}

void check_route(MemoryTables& tables, std::string_view name) {
  const auto row = read_complete_row(tables, name);
  if (row && is_chain(*row)) {
    static_cast<void>(read_chain(tables, name));
  } else {
    static_cast<void>(read_route(tables, name));
  }
}

void rename_route(MemoryTables& tables, std::string_view name, std::string_view new_name) {
  const auto row = read_row(tables, name);
  if (!row) fail_route(tables, name, "is missing");
  for (std::int64_t number = 0; number < count_blocks(*row); ++number) {
    write_block(tables, new_name, number, read_block(tables, name, number));
  }
  write_row(tables, new_name, *row);
  erase_route(tables, name);
}

bool erase_route(MemoryTables& tables, std::string_view name) {
  const bool there = read_row(tables, name).has_value();
  tables.erase_route(name);
  return there;
}

void verify_routes(MemoryTables& tables,
                   const std::function<void(const std::function<void()>&)>& check) {
  // Names in either table, so that a route that one of them has lost is found in the other.
  std::set<std::string> names;
  const auto add = [&](const std::vector<std::string>& found) {
    names.insert(found.begin(), found.end());
  };
  check([&] { add(tables.route_names()); });
  check([&] { add(tables.list_routes_with_blocks()); });
  for (const auto& name : names) {
    check([&] { check_route(tables, name); });
  }
}

}  // namespace panonav
