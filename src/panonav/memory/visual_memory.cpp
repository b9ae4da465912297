#include "panonav/memory/visual_memory.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <limits>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/memory/internal/comparison.hpp"
#include "panonav/memory/internal/exact_search.hpp"
#include "panonav/memory/internal/link_set.hpp"
#include "panonav/memory/internal/name_index.hpp"
#include "panonav/memory/internal/sketch_index.hpp"
#include "panonav/memory/internal/view_store.hpp"
#include "panonav/memory/reference_validation.hpp"

namespace panonav {

namespace {

using Row = ViewStore::Row;

}  // namespace

struct VisualMemory::Implementation {
  Implementation(SignatureShape shape_, float full_scale_, std::optional<ElevationBand> elevations_)
      : shape(shape_),
        full_scale(full_scale_),
        elevations(elevations_),
        store(shape_),
        index(shape_) {}

  Implementation(const Implementation& other)
      : shape(other.shape),
        full_scale(other.full_scale),
        elevations(other.elevations),
        store(other.store),
        index(other.searched().index),
        records(other.records),
        views(other.views),
        rows(other.rows),
        view_of_row(other.view_of_row),
        names(other.names),
        links(other.links),
        next_id(other.next_id) {}
  Implementation(Implementation&&) = delete;
  Implementation& operator=(const Implementation&) = delete;
  Implementation& operator=(Implementation&&) = delete;
  ~Implementation() = default;

  [[nodiscard]] std::optional<std::size_t> find_position(ViewId view) const {
    if (views.empty() || view < views.front()) return std::nullopt;
    // Where no view was removed, ids follow each other.
    const std::size_t offset = view.value - views.front().value;
    if (offset < views.size() && views[offset] == view) return offset;
    const auto found = std::ranges::lower_bound(views, view);
    if (found == views.end() || *found != view) return std::nullopt;
    return static_cast<std::size_t>(found - views.begin());
  }
  [[nodiscard]] std::size_t position(ViewId view) const {
    const auto found = find_position(view);
    if (!found) throw ContractError("view", std::to_string(view.value), "a view of the memory");
    return *found;
  }
  void require_view(ViewId view) const { static_cast<void>(position(view)); }
  [[nodiscard]] Row row(ViewId view) const { return rows[position(view)]; }
  [[nodiscard]] auto name_of_row() const {
    return [this](Row row) -> const std::string& { return records[row].name; };
  }

  /// Returns the views and the index for a search, after indexing all rows that were appended since
  /// the last search.
  [[nodiscard]] SearchedViews searched() const {
    index_rows();
    return {shape, store, index, views, rows, view_of_row};
  }
  void index_rows() const {
    if (all_indexed.load(std::memory_order_acquire)) return;
    const std::lock_guard lock(indexing);
    index.insert(store, not_indexed);
    not_indexed.clear();
    all_indexed.store(true, std::memory_order_release);
  }

  SignatureShape shape;
  float full_scale;
  std::optional<ElevationBand> elevations;
  ViewStore store;
  mutable SketchIndex index;
  mutable std::vector<Row> not_indexed;  // in the order of appending
  mutable std::atomic<bool> all_indexed = true;
  mutable std::mutex indexing;
  std::deque<ReferenceInfo>
      records;                // by row of the store; a deque, so that they stay where they are
  std::vector<ViewId> views;  // ascending
  std::vector<Row> rows;      // of `views`
  std::vector<ViewId> view_of_row;
  NameIndex names;
  LinkSet links;
  std::uint64_t next_id = 0;
};

VisualMemory::VisualMemory(SignatureShape shape, float full_scale,
                           std::optional<ElevationBand> elevations) {
  require(shape.rows >= 1, "rows", shape.rows, ">= 1");
  require(shape.components >= 1, "components", shape.components, ">= 1");
  // Below this size all distances and their bounds stay far below 2^30, the bound of rows without a
  // view.
  constexpr double max_bytes = 1 << 20;
  require(static_cast<double>(shape.rows) * shape.components < max_bytes, "rows x components",
          static_cast<double>(shape.rows) * shape.components, "< 2^20");
  require(std::isfinite(full_scale) && full_scale > 0.0F, "full_scale", full_scale, "finite, > 0");
  implementation_ = std::make_unique<Implementation>(shape, full_scale, elevations);
}

VisualMemory::~VisualMemory() = default;
VisualMemory::VisualMemory(VisualMemory&&) noexcept = default;
VisualMemory& VisualMemory::operator=(VisualMemory&&) noexcept = default;
VisualMemory::VisualMemory(const VisualMemory& other)
    : implementation_(std::make_unique<Implementation>(*other.implementation_)) {}
VisualMemory& VisualMemory::operator=(const VisualMemory& other) {
  if (this != &other) implementation_ = std::make_unique<Implementation>(*other.implementation_);
  return *this;
}

SignatureShape VisualMemory::shape() const noexcept {
  return implementation_->shape;
}
float VisualMemory::full_scale() const noexcept {
  return implementation_->full_scale;
}
const std::optional<ElevationBand>& VisualMemory::elevations() const noexcept {
  return implementation_->elevations;
}
std::size_t VisualMemory::size() const noexcept {
  return implementation_->views.size();
}

ViewId VisualMemory::append(const PackedSignature& signature, ReferenceInfo info) {
  require(implementation_->next_id <= std::numeric_limits<std::uint32_t>::max(), "next view id",
          static_cast<double>(implementation_->next_id), "< 2^32");
  const ViewId id{static_cast<std::uint32_t>(implementation_->next_id)};
  append_with_id(id, signature, std::move(info));
  return id;
}

ViewId VisualMemory::append(const FourierSignature& signature, ReferenceInfo info) {
  return append(pack(signature, implementation_->full_scale), std::move(info));
}

void VisualMemory::append_with_id(ViewId id, const PackedSignature& signature, ReferenceInfo info) {
  require_signature(signature, implementation_->shape);
  append_with_id(id, signature.magnitudes, signature.phases, std::move(info));
}

void VisualMemory::append_with_id(ViewId id, std::span<const std::uint8_t> magnitudes,
                                  std::span<const std::uint8_t> phases, ReferenceInfo info) {
  Implementation& memory = *implementation_;
  require_signature(magnitudes, phases, memory.shape);
  validate(info);
  if (id.value < memory.next_id) {
    throw ContractError("view id", id.value, ">= " + std::to_string(memory.next_id) + ", ids grow");
  }
  // The slot of the name is in no cache when a memory is loaded: it arrives while bytes are copied.
  memory.names.prefetch(info.name);
  const Row row = memory.store.add(magnitudes, phases);
  if (memory.names.find(info.name, memory.name_of_row())) {
    memory.store.free(row);
    throw ContractError("view name", "\"" + info.name + "\", which the memory already contains",
                        "a name that is unique");
  }
  if (row == memory.records.size()) {
    memory.records.push_back(std::move(info));
    memory.view_of_row.push_back(id);
  } else {
    memory.records[row] = std::move(info);
    memory.view_of_row[row] = id;
  }
  memory.names.insert(memory.records[row].name, row);
  memory.views.push_back(id);
  memory.rows.push_back(row);
  memory.not_indexed.push_back(row);
  memory.all_indexed.store(false, std::memory_order_relaxed);
  memory.next_id = std::uint64_t{id.value} + 1;
}

void VisualMemory::remove(ViewId view) {
  Implementation& memory = *implementation_;
  const std::size_t position = memory.position(view);
  const Row row = memory.rows[position];
  memory.links.erase_links_of(view);
  memory.names.erase(memory.records[row].name, memory.name_of_row());
  memory.records[row] = {};
  memory.index_rows();
  memory.index.erase(row);
  memory.store.free(row);
  memory.views.erase(memory.views.begin() + static_cast<std::ptrdiff_t>(position));
  memory.rows.erase(memory.rows.begin() + static_cast<std::ptrdiff_t>(position));
}

std::span<const ViewId> VisualMemory::views() const noexcept {
  return implementation_->views;
}

bool VisualMemory::contains(ViewId view) const noexcept {
  return implementation_->find_position(view).has_value();
}

std::optional<ViewId> VisualMemory::find(std::string_view name) const {
  const auto row = implementation_->names.find(name, implementation_->name_of_row());
  if (!row) return std::nullopt;
  return implementation_->view_of_row[*row];
}

const ReferenceInfo& VisualMemory::info(ViewId view) const {
  return implementation_->records[implementation_->row(view)];
}

void VisualMemory::set_pose(ViewId view, std::optional<ReferencePose> pose) {
  if (pose) validate(*pose);
  implementation_->records[implementation_->row(view)].pose = pose;
}

PackedSignature VisualMemory::packed(ViewId view) const {
  const Row row = implementation_->row(view);
  const std::size_t size = implementation_->shape.size();
  const std::uint8_t* const magnitudes = implementation_->store.magnitudes(row);
  const std::uint8_t* const phases = implementation_->store.phases(row);
  return {implementation_->shape, {magnitudes, magnitudes + size}, {phases, phases + size}};
}

FourierSignature VisualMemory::signature(ViewId view) const {
  return unpack(packed(view), implementation_->full_scale, implementation_->elevations);
}

void VisualMemory::link(const Link& link) {
  implementation_->require_view(link.a);
  implementation_->require_view(link.b);
  if (link.a == link.b) {
    throw ContractError("link", "from view " + std::to_string(link.a.value) + " to itself",
                        "two different views");
  }
  implementation_->links.insert(link);
}

void VisualMemory::unlink(ViewId a, ViewId b) {
  implementation_->links.erase(a, b);
}
std::span<const Link> VisualMemory::links() const noexcept {
  return implementation_->links.links();
}
std::vector<ViewId> VisualMemory::neighbours(ViewId view) const {
  implementation_->require_view(view);
  return implementation_->links.neighbours(view);
}

SearchResult VisualMemory::search(const PackedSignature& query, const SearchOptions& options,
                                  const SearchMask& mask) const {
  return exact_search(implementation_->searched(), query, options, mask,
                      kernels::chosen_instructions());
}

std::vector<VisualMemory::HierarchyLevel> VisualMemory::hierarchy(
    const PackedSignature& query, double tolerance, int components,
    const std::function<bool(const VisualMemory::HierarchyLevel&)>& stop,
    const SearchMask& mask) const {
  return hierarchical_search(implementation_->searched(), query, tolerance, components, stop, mask,
                             kernels::chosen_instructions());
}

}  // namespace panonav
