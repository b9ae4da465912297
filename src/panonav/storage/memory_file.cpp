#include "panonav/storage/memory_file.hpp"

#include <algorithm>
#include <functional>
#include <set>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/memory/reference_validation.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/memory_file_access.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/memory_verification.hpp"
#include "panonav/storage/internal/route_tables.hpp"
#include "panonav/storage/memory_header.hpp"

namespace panonav {

namespace {

using Bytes = std::vector<std::uint8_t>;

// Sorts the ends of a link so that a < b: links have no direction, and each pair must be stored
// only once.
Link order_ends(Link link) {
  if (link.b < link.a) std::swap(link.a, link.b);
  return link;
}

void require_view(const NewView& view, SignatureShape shape) {
  if (view.signature.shape != shape || view.signature.magnitudes.size() != shape.size() ||
      view.signature.phases.size() != shape.size()) {
    throw ContractError(
        "signature shape",
        std::to_string(view.signature.shape.rows) + " rows x " +
            std::to_string(view.signature.shape.components) + " components",
        std::to_string(shape.rows) + " rows x " + std::to_string(shape.components) + " components");
  }
  validate(view.info);
}

// Throws the ContractError for the name of a `kind` ("map", "route") that the file does not have.
[[noreturn]] void throw_unknown_name(const char* kind, std::string_view name) {
  throw ContractError(kind, std::string(name), "a " + std::string(kind) + " of the memory file");
}

std::string make_parameter_key(std::string_view name) {
  return "parameter." + std::string(name);
}

}  // namespace

struct MemoryFile::Implementation {
  /// Runs `work(tables)` in a writing transaction, commits it and returns the result of `work`.
  template <class Work>
  auto write(const Work& work) {
    const auto transaction = tables->transaction(MemoryTables::Kind::writing);
    if constexpr (std::is_void_v<decltype(work(*tables))>) {
      work(*tables);
      transaction->commit();
    } else {
      auto result = work(*tables);
      transaction->commit();
      return result;
    }
  }
  /// Runs `work(tables)` in a reading transaction, which shows one state of the memory, and returns
  /// its result.
  template <class Work>
  auto read(const Work& work) {
    const auto transaction = tables->transaction(MemoryTables::Kind::reading);
    return work(*tables);
  }

  [[nodiscard]] VisualMemory make_empty_memory() const {
    return {header.shape, header.full_scale, header.elevations};
  }
  /// Appends a row to a memory. Throws DamageError as `check_row`, and for a row that repeats
  /// another.
  void append_row(const ViewRow& row, VisualMemory& memory) {
    const auto signature = tables->check_row(row, header.shape, scratch).signature;
    try {
      memory.append_with_id(row.id, signature.first(header.shape.size()),
                            signature.subspan(header.shape.size()), row.info);
    } catch (const ContractError& error) {
      tables->fail_damaged(error.what());
    }
  }
  /// Appends a link to a memory, unless one of its views was left out. Throws as `append_row`.
  void append_link(const LinkRow& row, VisualMemory& memory) const {
    if (tables->is_left_out(row.a) || tables->is_left_out(row.b)) return;
    const Link link = tables->check_row(row);
    if (!memory.contains(link.a) || !memory.contains(link.b)) tables->fail_link_without_view(link);
    memory.link(link);
  }
  /// Returns the attachment of a view; nullopt if there is none, or if it was left out as bad.
  [[nodiscard]] std::optional<Bytes> read_attachment(ViewAttachment table, ViewId view) const {
    std::optional<Bytes> bytes;
    // The view itself is kept; otherwise anyone who may add attachments could hide it by a bad one.
    tables->accept_row(std::nullopt, [&] { bytes = tables->read_checked_bytes(table, view); });
    return bytes;
  }
  /// Changes name, pose or stamp of a view. Throws as `throw_unknown_view`.
  void change_info(ViewId view, const std::function<void(ReferenceInfo&)>& change) {
    write([&](MemoryTables&) {
      std::optional<ReferenceInfo> info;
      std::int64_t new_checksum = 0;
      tables->read_views(std::span(&view, 1), [&](const ViewRow& row) {
        info = tables->check_row(row, header.shape, scratch).info;
        change(*info);
        new_checksum = view_checksum(scratch, view, *info, row.signature);
      });
      tables->write_info(view, info.value(), new_checksum);
    });
  }

  std::filesystem::path address;  ///< as passed to `open`; may contain a password
  std::unique_ptr<MemoryTables> tables;
  MemoryHeader header;
  RecordBytes scratch = {};  ///< buffer, reused for every view
};

MemoryFile::MemoryFile(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
MemoryFile::~MemoryFile() = default;
MemoryFile::MemoryFile(MemoryFile&&) noexcept = default;
MemoryFile& MemoryFile::operator=(MemoryFile&&) noexcept = default;

MemoryFile MemoryFile::create(const std::filesystem::path& path, const MemoryHeader& header) {
  create_memory_tables(path, header, {});
  return open(path, Access::read_write);
}

MemoryFile MemoryFile::reopen(Access access) const {
  return open(implementation_->address, access);
}

MemoryFile MemoryFile::open(const std::filesystem::path& path, Access access) {
  auto [tables, header] = open_memory_tables(path, access);
  return MemoryFile(std::unique_ptr<Implementation>(
      new Implementation{path, std::move(tables), std::move(header)}));
}

void MemoryFile::copy_to(const std::filesystem::path& path) const {
  implementation_->read([&](MemoryTables& from) {
    create_memory_tables(path, header(), [&](MemoryTables& to) {
      for (const auto& [key, value] : from.settings()) {
        if (key.starts_with("parameter.")) to.write_setting(key, value);
      }
      std::set<ViewId> copied;
      constexpr std::size_t views_per_part = 1000;  // a few megabytes
      for_each_batch(views(), views_per_part, [&](std::span<const ViewId> ids) {
        const VisualMemory memory = load(ids);
        std::vector<NewView> part;
        for (const ViewId id : memory.views()) {
          part.push_back({memory.info(id), memory.packed(id), thumbnail(id).value_or(Bytes{}),
                          features(id).value_or(Bytes{})});
        }
        to.insert(memory.views(), part);
        copied.insert(memory.views().begin(), memory.views().end());
      });
      std::vector<Link> kept_links;
      for (const Link& link : links()) {
        from.accept_row(std::nullopt, [&] {
          if (!copied.contains(link.a) || !copied.contains(link.b))
            from.fail_link_without_view(link);
          kept_links.push_back(link);
        });
      }
      to.write_links(kept_links);
      for (const std::string& name : map_names()) {
        from.accept_row(std::nullopt, [&] { write_map(to, name, this->map(name).value()); });
      }
      for (const std::string& name : list_stored_routes(from)) {
        from.accept_row(std::nullopt, [&] { copy_route(from, to, name); });
      }
    });
  });
}

const MemoryHeader& MemoryFile::header() const noexcept {
  return implementation_->header;
}
const std::filesystem::path& MemoryFile::path() const noexcept {
  return implementation_->tables->path();
}

void MemoryFile::change(const std::function<void()>& changes,
                        const std::optional<std::string>& undo) {
  implementation_->write([&](MemoryTables& tables) {
    if (undo) {
      tables.run_undoably(changes, *undo);
    } else {
      changes();
    }
  });
}

std::vector<MemoryFile::KeptChange> MemoryFile::history() const {
  return implementation_->tables->history();
}

std::optional<std::string> MemoryFile::undoable() const {
  const std::vector<MemoryFile::KeptChange> kept = history();
  if (kept.empty() || !kept.front().undoable) return std::nullopt;
  return kept.front().what;
}

void MemoryFile::undo() {
  implementation_->write([&](MemoryTables& tables) { undo_newest_change(tables, header()); });
}

void MemoryFile::require_undo_possible() {
  // Rolled back, as it is not committed.
  const auto transaction = implementation_->tables->transaction(MemoryTables::Kind::writing);
  undo_newest_change(*implementation_->tables, header());
}

ViewId MemoryFile::append(const NewView& view) {
  return append(std::span(&view, 1)).front();
}

std::vector<ViewId> MemoryFile::append(std::span<const NewView> views) {
  for (const NewView& view : views) require_view(view, implementation_->header.shape);
  return implementation_->write([&](MemoryTables& tables) {
    const std::uint32_t last = tables.last_id();
    if (views.size() >= UINT32_MAX - last) {
      tables.fail_damaged("there is no id left for another view");
    }
    std::vector<ViewId> ids(views.size());
    for (std::size_t i = 0; i < ids.size(); ++i) ids[i].value = last + 1 + std::uint32_t(i);
    tables.insert(ids, views);
    return ids;
  });
}

void MemoryFile::remove(std::span<const ViewId> views) {
  implementation_->write([&](MemoryTables& tables) {
    tables.require_views(views);
    std::set<ViewId> removed;
    for (const ViewId view : views) {
      if (!removed.insert(view).second) throw_unknown_view(view);
    }
    tables.remove(views);
    erase_views_from_maps(tables, views);
  });
}

void MemoryFile::set_pose(ViewId view, const std::optional<ReferencePose>& pose) {
  if (pose) validate(*pose);
  implementation_->change_info(view, [&](ReferenceInfo& info) { info.pose = pose; });
}

void MemoryFile::rename(ViewId view, std::string_view name) {
  check_new_name("view", name);
  implementation_->change_info(view, [&](ReferenceInfo& info) { info.name = name; });
}

void MemoryFile::link(std::span<const Link> links) {
  std::vector<Link> ordered;
  std::vector<ViewId> ends;
  for (const Link& unordered : links) {
    const Link link = ordered.emplace_back(order_ends(unordered));
    if (link.a == link.b) {
      throw ContractError("link", "of view " + std::to_string(link.a.value) + " to itself",
                          "two different views");
    }
    ends.insert(ends.end(), {link.a, link.b});
  }
  implementation_->write([&](MemoryTables& tables) {
    tables.require_views(ends);
    tables.write_links(ordered);
  });
}

void MemoryFile::unlink(ViewId a, ViewId b) {
  const Link pair = order_ends({a, b, Link::Kind::sequence});
  implementation_->write([&](MemoryTables& tables) { tables.erase_link(pair.a, pair.b); });
}

std::optional<ViewId> MemoryFile::find(std::string_view name) const {
  return implementation_->tables->find(name);
}

std::vector<std::string> MemoryFile::names() const {
  return implementation_->tables->names();
}

std::vector<ViewId> MemoryFile::views_with_thumbnail() const {
  return implementation_->tables->views_with_attachment(ViewAttachment::thumbnails);
}

std::optional<Bytes> MemoryFile::thumbnail(ViewId view) const {
  return implementation_->read_attachment(ViewAttachment::thumbnails, view);
}

bool MemoryFile::has_features() const {
  return implementation_->tables->has_attachments(ViewAttachment::features);
}

std::optional<Bytes> MemoryFile::features(ViewId view) const {
  return implementation_->read_attachment(ViewAttachment::features, view);
}

void MemoryFile::set_parameter(std::string_view name, std::string_view value) {
  implementation_->write([&](MemoryTables& tables) {
    tables.write_setting(make_parameter_key(name), std::string(value));
  });
}

std::optional<std::string> MemoryFile::parameter(std::string_view name) const {
  const Settings settings = implementation_->tables->settings();
  const auto found = settings.find(make_parameter_key(name));
  if (found == settings.end()) return std::nullopt;
  std::optional<std::string> value;
  implementation_->tables->accept_row(std::nullopt, [&] {
    const auto* text = std::get_if<std::string>(&found->second);
    if (text == nullptr) implementation_->tables->fail_damaged("parameter " + std::string(name));
    value = *text;
  });
  return value;
}

void MemoryFile::save_map(std::string_view name, const TopologicalMap& map) {
  implementation_->write([&](MemoryTables& tables) {
    std::vector<ViewId> views;
    for (const TopologicalMap::Node& node : map.nodes) views.push_back(node.view);
    tables.require_views(views);
    write_map(tables, name, map);
  });
}

std::optional<TopologicalMap> MemoryFile::map(std::string_view name) const {
  return implementation_->read([&](MemoryTables& tables) {
    auto map = read_map(tables, name);
    if (map) remove_views_from_map(*map, tables.left_out_views());
    return map;
  });
}

void MemoryFile::remove_map(std::string_view name) {
  implementation_->write([&](MemoryTables& tables) {
    if (!erase_map(tables, name)) throw_unknown_name("map", name);
  });
}

std::vector<std::string> MemoryFile::map_names() const {
  return implementation_->read([](MemoryTables& tables) { return tables.map_names(); });
}

std::size_t MemoryFile::append_route(std::string_view name, const RoutePanorama& more) {
  return implementation_->write(
      [&](MemoryTables& tables) { return append_to_route(tables, name, more); });
}

std::optional<RoutePanorama> MemoryFile::route(std::string_view name) const {
  return implementation_->read([&](MemoryTables& tables) { return read_route(tables, name); });
}

void MemoryFile::save_chain(std::string_view name, const SnapshotChain& chain) {
  implementation_->write([&](MemoryTables& tables) { write_chain(tables, name, chain); });
}

std::optional<SnapshotChain> MemoryFile::chain(std::string_view name) const {
  return implementation_->read([&](MemoryTables& tables) { return read_chain(tables, name); });
}

std::optional<RouteMethod> MemoryFile::route_method(std::string_view name) const {
  return implementation_->read(
      [&](MemoryTables& tables) { return read_route_method(tables, name); });
}

std::uint64_t MemoryFile::route_bytes(std::string_view name) const {
  const std::int64_t bytes =
      implementation_->read([&](MemoryTables& tables) { return tables.route_bytes(name); });
  if (bytes == 0) throw_unknown_name("route", name);
  return static_cast<std::uint64_t>(bytes);
}

void MemoryFile::remove_route(std::string_view name) {
  implementation_->write([&](MemoryTables& tables) {
    if (!erase_route(tables, name)) throw_unknown_name("route", name);
  });
}

void MemoryFile::rename_route(std::string_view name, std::string_view new_name) {
  check_new_name("route", new_name);
  implementation_->write([&](MemoryTables& tables) {
    const auto names = route_names();
    if (std::ranges::find(names, name) == names.end()) throw_unknown_name("route", name);
    if (std::ranges::find(names, new_name) != names.end()) {
      throw_used_name("route", new_name, path());
    }
    panonav::rename_route(tables, name, new_name);
    // The parameters with the source of its lines and what was learnt from them are renamed, too.
    for (const std::string prefix : {"route.", "learnt route."}) {
      const std::string from = prefix + std::string(name);
      if (const auto text = parameter(from)) {
        set_parameter(prefix + std::string(new_name), *text);
        tables.erase_setting(make_parameter_key(from));
      }
    }
  });
}

std::vector<std::string> MemoryFile::route_names() const {
  return implementation_->read([](MemoryTables& tables) { return tables.route_names(); });
}

VisualMemory MemoryFile::load() const {
  return implementation_->read([&](MemoryTables& tables) {
    VisualMemory memory = implementation_->make_empty_memory();
    tables.read_views([&](const ViewRow& row) {
      tables.accept_row(row.id, [&] { implementation_->append_row(row, memory); });
    });
    tables.read_links([&](const LinkRow& row) {
      tables.accept_row(std::nullopt, [&] { implementation_->append_link(row, memory); });
    });
    return memory;
  });
}

VisualMemory MemoryFile::load(std::span<const ViewId> views) const {
  for (std::size_t i = 1; i < views.size(); ++i) {
    require(views[i - 1] < views[i], "views", static_cast<double>(views[i].value), "ascending");
  }
  return implementation_->read([&](MemoryTables& tables) {
    VisualMemory memory = implementation_->make_empty_memory();
    tables.read_views(views, [&](const ViewRow& row) {
      tables.accept_row(row.id, [&] { implementation_->append_row(row, memory); });
    });
    return memory;
  });
}

void MemoryFile::read_views(const std::function<void(ViewId, const ReferenceInfo&,
                                                     const PackedSignature&)>& consume) const {
  implementation_->read([&](MemoryTables& tables) {
    PackedSignature signature;
    std::optional<ViewId> last;
    tables.read_views([&](const ViewRow& row) {
      const bool is_intact = tables.accept_row(row.id, [&] {
        tables.check_row(row, header().shape, implementation_->scratch);
        if (last && row.id <= *last) tables.fail_damaged("views are out of order");
      });
      if (!is_intact) return;
      last = row.id;
      unpack_signature(row.signature, header().shape, signature);
      consume(row.id, row.info, signature);
    });
  });
}

std::vector<ViewId> MemoryFile::views() const {
  return implementation_->tables->views();
}

std::vector<ViewId> MemoryFile::views_within(const PositionBounds& bounds) const {
  std::vector<ViewId> views;
  for (const PosedView& row : implementation_->tables->views_within(bounds)) {
    views.push_back(row.id);
  }
  return views;
}

std::vector<MemoryFile::ViewPlace> MemoryFile::places() const {
  return implementation_->read([](MemoryTables& tables) { return tables.places(); });
}

MemoryFile::Counts MemoryFile::counts() const {
  return implementation_->read([](MemoryTables& tables) { return tables.counts(); });
}

std::vector<Link> MemoryFile::links() const {
  return implementation_->read([](MemoryTables& tables) {
    std::vector<Link> links;
    tables.read_links([&](const LinkRow& row) {
      if (tables.is_left_out(row.a) || tables.is_left_out(row.b)) return;
      tables.accept_row(std::nullopt, [&] { links.push_back(tables.check_row(row)); });
    });
    return links;
  });
}

std::vector<MemoryFile::Fault> MemoryFile::verify() const {
  return verify_memory(*implementation_->tables, implementation_->header);
}

std::vector<MemoryFile::Fault> MemoryFile::left_out() const {
  return implementation_->tables->left_out();
}

MemoryFile::Info MemoryFile::info() const {
  return implementation_->read([](MemoryTables& tables) { return tables.info(); });
}

}  // namespace panonav
