#include "panonav/storage/memory_file.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/memory_file_access.hpp"
#include "panonav/storage/internal/memory_file_implementation.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/memory_verification.hpp"
#include "panonav/storage/memory_header.hpp"

namespace panonav {

namespace {

// Links have no direction; a < b makes a pair unique.
Link ordered(Link link) {
  if (link.b < link.a) std::swap(link.a, link.b);
  return link;
}

void require_finite(const std::optional<ReferencePose>& pose) {
  if (!pose) return;
  require(std::isfinite(pose->x_m), "pose x_m", pose->x_m, "finite");
  require(std::isfinite(pose->y_m), "pose y_m", pose->y_m, "finite");
  if (pose->heading_rad) {
    require(std::isfinite(*pose->heading_rad), "pose heading_rad", *pose->heading_rad, "finite");
  }
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
  if (view.info.name.empty()) throw ContractError("view name", "empty", "at least one character");
  require_finite(view.info.pose);
  if (view.info.stamp_s) {
    require(std::isfinite(*view.info.stamp_s), "stamp_s", *view.info.stamp_s, "finite");
  }
}

}  // namespace

MemoryFile::Implementation::Implementation(std::filesystem::path address_,
                                           std::unique_ptr<MemoryTables> tables_,
                                           MemoryHeader header_)
    : address(std::move(address_)), tables(std::move(tables_)), header(std::move(header_)) {}

const ViewRow& MemoryFile::Implementation::checked(const ViewRow& row) {
  return tables->checked(row, header.shape, scratch);
}

void MemoryFile::Implementation::append_row(const ViewRow& row, VisualMemory& memory) {
  const auto signature = checked(row).signature;
  const auto half = static_cast<std::ptrdiff_t>(header.shape.size());
  packed.shape = header.shape;
  packed.magnitudes.assign(signature.begin(), signature.begin() + half);
  packed.phases.assign(signature.begin() + half, signature.end());
  memory.append_as(row.id, packed, row.info);
}

void MemoryFile::Implementation::change_info(ViewId view,
                                             const std::function<void(ReferenceInfo&)>& change) {
  std::optional<ReferenceInfo> info;
  std::int64_t new_checksum = 0;
  tables->read_views(std::span(&view, 1), [&](const ViewRow& row) {
    info = checked(row).info;
    change(*info);
    new_checksum = view_checksum(scratch, view, *info, row.signature);
  });
  tables->write_info(view, info.value(), new_checksum);
}

MemoryFile::MemoryFile(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
MemoryFile::~MemoryFile() = default;
MemoryFile::MemoryFile(MemoryFile&&) noexcept = default;
MemoryFile& MemoryFile::operator=(MemoryFile&&) noexcept = default;

MemoryFile MemoryFile::create(const std::filesystem::path& path, const MemoryHeader& header) {
  make_memory_tables(path, header, {});
  return open(path, Access::read_write);
}

MemoryFile MemoryFile::reopen(Access access) const {
  return open(implementation_->address, access);
}

MemoryFile MemoryFile::open(const std::filesystem::path& path, Access access) {
  auto [tables, header] = open_memory_tables(path, access);
  return MemoryFile(std::make_unique<Implementation>(path, std::move(tables), std::move(header)));
}

const MemoryHeader& MemoryFile::header() const noexcept {
  return implementation_->header;
}
const std::filesystem::path& MemoryFile::path() const noexcept {
  return implementation_->tables->path();
}

void MemoryFile::change(const std::function<void()>& changes,
                        const std::optional<std::string>& undo) {
  MemoryTables& tables = *implementation_->tables;
  const auto transaction = tables.transaction(MemoryTables::Kind::writing);
  if (undo) {
    tables.keep_for_undo(changes, *undo);
  } else {
    changes();
  }
  transaction->commit();
}

std::vector<KeptChange> MemoryFile::history() const {
  return implementation_->tables->history();
}

std::optional<std::string> MemoryFile::undoable() const {
  const std::vector<KeptChange> kept = history();
  if (kept.empty() || !kept.front().undoable) return std::nullopt;
  return kept.front().what;
}

void MemoryFile::undo() {
  MemoryTables& tables = *implementation_->tables;
  const auto transaction = tables.transaction(MemoryTables::Kind::writing);
  if (!undoable()) {
    throw ContractError("undo", "not possible", "after a change that was kept for it");
  }
  tables.undo();
  transaction->commit();
}

ViewId MemoryFile::append(const NewView& view) {
  return append(std::span(&view, 1)).front();
}

std::vector<ViewId> MemoryFile::append(std::span<const NewView> views) {
  for (const NewView& view : views) require_view(view, implementation_->header.shape);
  MemoryTables& tables = *implementation_->tables;
  const auto transaction = tables.transaction(MemoryTables::Kind::writing);
  const std::uint32_t last = tables.last_id();
  if (views.size() >= UINT32_MAX - last) {
    tables.fail_damaged("there is no id left for another view");
  }
  std::vector<ViewId> ids(views.size());
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i].value = last + 1 + std::uint32_t(i);
  tables.insert(ids, views);
  transaction->commit();
  return ids;
}

void MemoryFile::remove(std::span<const ViewId> views) {
  MemoryTables& tables = *implementation_->tables;
  const auto transaction = tables.transaction(MemoryTables::Kind::writing);
  tables.require_views(views);
  std::set<ViewId> removed;
  for (const ViewId view : views) {
    if (!removed.insert(view).second) refuse_view(view);
  }
  tables.remove(views);
  forget_in_maps(tables, views);
  transaction->commit();
}

void MemoryFile::set_pose(ViewId view, const std::optional<ReferencePose>& pose) {
  require_finite(pose);
  const auto transaction = implementation_->tables->transaction(MemoryTables::Kind::writing);
  implementation_->change_info(view, [&](ReferenceInfo& info) { info.pose = pose; });
  transaction->commit();
}

void MemoryFile::rename(ViewId view, std::string_view name) {
  require_name("view", name);
  const auto transaction = implementation_->tables->transaction(MemoryTables::Kind::writing);
  implementation_->change_info(view, [&](ReferenceInfo& info) { info.name = name; });
  transaction->commit();
}

void MemoryFile::link(std::span<const Link> links) {
  std::vector<Link> wanted;
  std::vector<ViewId> ends;
  for (const Link& given : links) {
    const Link link = wanted.emplace_back(ordered(given));
    if (link.a == link.b) {
      throw ContractError("link", "of view " + std::to_string(link.a.value) + " to itself",
                          "two different views");
    }
    ends.insert(ends.end(), {link.a, link.b});
  }
  MemoryTables& tables = *implementation_->tables;
  const auto transaction = tables.transaction(MemoryTables::Kind::writing);
  tables.require_views(ends);
  tables.write_links(wanted);
  transaction->commit();
}

void MemoryFile::unlink(ViewId a, ViewId b) {
  const Link pair = ordered({a, b, LinkKind::sequence});
  const auto transaction = implementation_->tables->transaction(MemoryTables::Kind::writing);
  implementation_->tables->erase_link(pair.a, pair.b);
  transaction->commit();
}

std::optional<ViewId> MemoryFile::find(std::string_view name) const {
  return implementation_->tables->find(name);
}

std::vector<std::string> MemoryFile::names() const {
  return implementation_->tables->names();
}

std::vector<ViewId> MemoryFile::views_with_thumbnail() const {
  return implementation_->tables->views_with(BesideViews::thumbnails);
}

std::optional<std::vector<std::uint8_t>> MemoryFile::thumbnail(ViewId view) const {
  return implementation_->tables->checked_bytes(BesideViews::thumbnails, view);
}

bool MemoryFile::has_features() const {
  return implementation_->tables->has_any(BesideViews::features);
}

std::optional<std::vector<std::uint8_t>> MemoryFile::features(ViewId view) const {
  return implementation_->tables->checked_bytes(BesideViews::features, view);
}

void MemoryFile::set_parameter(std::string_view name, std::string_view value) {
  const auto transaction = implementation_->tables->transaction(MemoryTables::Kind::writing);
  implementation_->tables->write_setting("parameter." + std::string(name), std::string(value));
  transaction->commit();
}

std::optional<std::string> MemoryFile::parameter(std::string_view name) const {
  const Settings settings = implementation_->tables->settings();
  const auto found = settings.find("parameter." + std::string(name));
  if (found == settings.end()) return std::nullopt;
  const auto* text = std::get_if<std::string>(&found->second);
  if (text == nullptr) implementation_->tables->fail_damaged("parameter " + std::string(name));
  return *text;
}

VisualMemory MemoryFile::load() const {
  MemoryTables& tables = *implementation_->tables;
  const MemoryHeader& header = implementation_->header;
  VisualMemory memory(header.shape, header.full_scale, header.elevations);
  const auto reading = tables.transaction(MemoryTables::Kind::reading);
  try {
    tables.read_views([&](const ViewRow& row) { implementation_->append_row(row, memory); });
    tables.read_links([&](const LinkRow& row) { memory.link(tables.checked(row)); });
  } catch (const ContractError& error) {
    tables.fail_damaged(error.what());
  }
  return memory;
}

VisualMemory MemoryFile::load(std::span<const ViewId> views) const {
  for (std::size_t i = 1; i < views.size(); ++i) {
    require(views[i - 1] < views[i], "views", static_cast<double>(views[i].value), "ascending");
  }
  MemoryTables& tables = *implementation_->tables;
  const MemoryHeader& header = implementation_->header;
  VisualMemory memory(header.shape, header.full_scale, header.elevations);
  const auto reading = tables.transaction(MemoryTables::Kind::reading);
  tables.read_views(views, [&](const ViewRow& row) {
    try {
      implementation_->append_row(row, memory);
    } catch (const ContractError& error) {
      tables.fail_damaged(error.what());
    }
  });
  return memory;
}

std::vector<ViewId> MemoryFile::views() const {
  return implementation_->tables->views();
}

std::vector<ViewId> MemoryFile::views_within(const PositionBounds& bounds) const {
  std::vector<ViewId> views;
  for (const PositionRow& row : implementation_->tables->views_within(bounds)) {
    views.push_back(row.id);
  }
  return views;
}

std::vector<Link> MemoryFile::links() const {
  std::vector<Link> links;
  MemoryTables& tables = *implementation_->tables;
  const auto reading = tables.transaction(MemoryTables::Kind::reading);
  tables.read_links([&](const LinkRow& row) { links.push_back(tables.checked(row)); });
  return links;
}

std::vector<MemoryFault> MemoryFile::verify() const {
  return verify_memory(*implementation_->tables, implementation_->header);
}

MemoryFileInfo MemoryFile::info() const {
  const auto reading = implementation_->tables->transaction(MemoryTables::Kind::reading);
  return implementation_->tables->info();
}

}  // namespace panonav
