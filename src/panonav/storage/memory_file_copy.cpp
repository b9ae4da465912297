// A memory as another one: from a file to a server, and back.

#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/memory_file_access.hpp"
#include "panonav/storage/internal/memory_file_implementation.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/route_tables.hpp"

namespace panonav {

namespace {

using Bytes = std::vector<std::uint8_t>;

// The next views, with what lies beside them.
std::vector<NewView> views_of(const MemoryFile& from, std::span<const ViewId> ids) {
  const VisualMemory memory = from.load(ids);
  std::vector<NewView> views;
  for (const ViewId id : ids) {
    views.push_back({memory.info(id), memory.packed(id), from.thumbnail(id).value_or(Bytes{}),
                     from.features(id).value_or(Bytes{})});
  }
  return views;
}

}  // namespace

void MemoryFile::copy_to(const std::filesystem::path& path) const {
  MemoryTables& from = *implementation_->tables;
  const auto reading = from.transaction(MemoryTables::Kind::reading);
  make_memory_tables(path, header(), [&](MemoryTables& to) {
    for (const auto& [key, value] : from.settings()) {
      if (key.starts_with("parameter.")) to.write_setting(key, value);
    }
    const std::vector<ViewId> all = views();
    constexpr std::size_t at_once = 1000;  // some megabytes
    in_parts(all, at_once,
             [&](std::span<const ViewId> ids) { to.insert(ids, views_of(*this, ids)); });
    to.write_links(links());
    for (const std::string& name : map_names()) write_map(to, name, read_map(from, name).value());
    for (const std::string& name : route_names()) {
      append_to_route(to, name, read_route(from, name).value());
    }
  });
}

}  // namespace panonav
