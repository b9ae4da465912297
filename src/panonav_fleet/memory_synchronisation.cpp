#include "panonav_fleet/memory_synchronisation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/memory_file_access.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav_fleet/internal/synchronisation.hpp"

namespace panonav::fleet {

std::vector<MemoryArea> areas_around(double x_m, double y_m, double radius_m) {
  require(std::isfinite(x_m), "x_m", x_m, "finite");
  require(std::isfinite(y_m), "y_m", y_m, "finite");
  require(std::isfinite(radius_m) && radius_m >= 0.0, "radius_m", radius_m, ">= 0, finite");
  const MemoryArea low = to_memory_area(x_m - radius_m, y_m - radius_m);
  const MemoryArea high = to_memory_area(x_m + radius_m, y_m + radius_m);
  constexpr double max_areas = 1e6;
  const double areas = (high.column - low.column + 1.0) * (high.row - low.row + 1.0);
  require(areas <= max_areas, "areas within radius_m", areas, "up to a million");
  std::vector<MemoryArea> around;
  for (double column = low.column; column <= high.column; ++column) {
    for (double row = low.row; row <= high.row; ++row) {
      const double left_m = column * memory_area_side_m;
      const double bottom_m = row * memory_area_side_m;
      const double dx_m = x_m - std::clamp(x_m, left_m, left_m + memory_area_side_m);
      const double dy_m = y_m - std::clamp(y_m, bottom_m, bottom_m + memory_area_side_m);
      if (std::hypot(dx_m, dy_m) <= radius_m) around.push_back({column, row});
    }
  }
  return around;
}

namespace {

void require_path_and_address(const std::filesystem::path& file,
                              const std::filesystem::path& server) {
  if (is_postgresql_address(file)) {
    throw ContractError("file", mask_passwords(file.string()), "the path of a memory file");
  }
  if (!is_postgresql_address(server)) {
    throw ContractError("server", server.string(), "the address of a memory on a server");
  }
}

}  // namespace

namespace {

/// Returns the memory on the server; creates it with the header of the file if it is missing.
std::unique_ptr<ServerExchange> connect_or_create_memory(const ServerAddress& address,
                                                         const MemoryHeader& header) {
  if (auto found = ServerExchange::connect(address)) return found;
  try {
    create_postgresql_memory(address, header, {});
  } catch (const FileError&) {
    if (auto found = ServerExchange::connect(address)) return found;  // another client was first
    throw;
  }
  auto made = ServerExchange::connect(address);
  if (!made) throw_missing_memory(address);
  return made;
}

}  // namespace

SynchronisationReport synchronise_memory(const std::filesystem::path& file,
                                         const std::filesystem::path& server,
                                         const SynchronisationOptions& options,
                                         const std::function<void(std::size_t)>& advance) {
  const auto begin = std::chrono::steady_clock::now();
  require_path_and_address(file, server);
  const ServerAddress address = parse_server_address(server);
  std::unique_ptr<ServerExchange> exchange;
  std::error_code ignored;
  if (!std::filesystem::exists(std::filesystem::symlink_status(file, ignored))) {
    exchange = ServerExchange::connect(address);
    if (!exchange) throw_missing_memory(address);
    create_memory_tables(file, to_header(exchange->tables().settings()), {});
  }
  OpenedMemory opened = open_memory_tables(file, Access::read_write);
  if (!exchange) exchange = connect_or_create_memory(address, opened.header);
  Synchronisation synchronisation(static_cast<SqliteTables&>(*opened.tables),
                                  std::move(opened.header), *exchange, options, advance);
  SynchronisationReport report = synchronisation.run();
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace panonav::fleet
