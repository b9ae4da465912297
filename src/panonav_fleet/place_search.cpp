#include "panonav_fleet/place_search.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <iterator>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/geometry/position_bound.hpp"
#include "panonav/storage/internal/memory_file_access.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/memory_tables.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav_fleet/internal/areas_of_views.hpp"
#include "panonav_fleet/internal/server_address.hpp"
#include "panonav_fleet/internal/view_sketches.hpp"
#include "panonav_fleet/memory_changes.hpp"

namespace panonav::fleet {

namespace {

std::optional<MemoryArea> to_memory_area_if_known(const std::optional<Point2>& position) {
  if (!position) return std::nullopt;
  return to_memory_area(position->x_m, position->y_m);
}

/// Collects views and sketches them in batches.
class Sketcher {
 public:
  explicit Sketcher(SignatureShape shape) : sketches(shape) {}
  /// Adds a row; returns true if a batch was sketched.
  bool add(MemoryTables& tables, const MagnitudesRow& row) {
    const bool is_accepted = tables.accept_row(row.id, [&] {
      if (row.magnitudes.size() != sketches.shape().size()) {
        tables.fail_damaged("view " + std::to_string(row.id.value) + " has another shape");
      }
    });
    if (!is_accepted) return false;
    ids_.push_back(row.id);
    magnitudes_.insert(magnitudes_.end(), row.magnitudes.begin(), row.magnitudes.end());
    areas_.emplace_back(row.id, to_memory_area_if_known(row.position));
    if (ids_.size() < views_per_batch) return false;
    flush();
    return true;
  }
  void flush() {
    sketches.insert(ids_, magnitudes_);
    ids_.clear();
    magnitudes_.clear();
  }
  void store_areas(AreasOfViews& areas) {
    for (const auto& [view, area] : areas_) areas.set(view, area);
    areas_.clear();
  }
  ViewSketches sketches;

 private:
  static constexpr std::size_t views_per_batch = 1 << 15;
  std::vector<std::pair<ViewId, std::optional<MemoryArea>>> areas_;
  std::vector<ViewId> ids_;
  std::vector<std::uint8_t> magnitudes_;
};

}  // namespace

struct PlaceSearch::Implementation {
  /// State that searches read; it is replaced when views are added or removed.
  struct Sketched {
    ViewSketches sketches;
    std::uint64_t bytes = 0;
  };

  explicit Implementation(std::filesystem::path memory) : path(std::move(memory)) {
    // Listens before it reads, so that no change is missed.
    if (is_postgresql_address(path)) changes.emplace(path);
    OpenedMemory opened = open_memory_tables(path, Access::read_only);
    header = std::move(opened.header);
    own = std::move(opened.tables);
    sketch_all_views();
  }

  [[nodiscard]] std::unique_ptr<MemoryTables> connect() const {
    return open_memory_tables(path, Access::read_only).tables;
  }

  /// Cuts the range of ids into one part for each connection. Ids mostly ascend in the order of
  /// recording, so a part has nearby places.
  void sketch_all_views() {
    const std::uint32_t last = own->last_id();
    const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
    const std::size_t parts = last < 100000 ? 1 : std::min<std::size_t>(cores, 16);
    std::vector<Sketcher> sketchers(parts, Sketcher(header.shape));
    std::vector<std::exception_ptr> faults(parts);
    const auto read_part = [&](std::size_t part, MemoryTables& tables) {
      const auto border = [&](std::size_t i) {
        return static_cast<std::uint32_t>(std::uint64_t{last} * i / parts);
      };
      const auto reading = tables.transaction(MemoryTables::Kind::reading);
      const auto store_areas = [&] {
        const std::lock_guard lock(mutex);
        sketchers[part].store_areas(areas);
      };
      // Reads a limited number of ids at a time, so that a server uses its index instead of sorting
      // all of them.
      constexpr std::uint32_t ids_per_query = 20000;
      for (std::uint32_t before = border(part); before < border(part + 1);) {
        const std::uint32_t end = before + std::min(ids_per_query, border(part + 1) - before);
        tables.read_magnitudes({before + 1}, {end}, header.shape.size(),
                               [&](const MagnitudesRow& row) {
                                 if (sketchers[part].add(tables, row)) store_areas();
                               });
        before = end;
      }
      sketchers[part].flush();
      store_areas();
    };
    const auto try_part = [&](std::size_t part) {
      try {
        read_part(part, part == 0 ? *own : *connect());
      } catch (...) {
        faults[part] = std::current_exception();
      }
    };
    std::vector<std::thread> threads;
    for (std::size_t part = 1; part < parts; ++part) threads.emplace_back(try_part, part);
    try_part(0);
    for (std::thread& thread : threads) thread.join();
    for (const std::exception_ptr& fault : faults) {
      if (fault) std::rethrow_exception(fault);
    }
    ViewSketches all(header.shape);
    for (Sketcher& sketcher : sketchers) {
      all.insert(sketcher.sketches);
      sketcher = Sketcher(header.shape);
    }
    publish(std::move(all));
  }

  void publish(ViewSketches sketches) {
    const std::uint64_t bytes = sketches.bytes() + areas.bytes();
    auto next = std::make_shared<const Sketched>(Sketched{std::move(sketches), bytes});
    const std::lock_guard lock(mutex);
    current.swap(next);
  }
  [[nodiscard]] std::shared_ptr<const Sketched> sketched() const {
    const std::lock_guard lock(mutex);
    return current;
  }

  // ---- connections of searches

  [[nodiscard]] std::unique_ptr<MemoryTables> borrow_connection() const {
    const std::lock_guard lock(mutex);
    if (idle.empty()) return nullptr;
    auto tables = std::move(idle.back());
    idle.pop_back();
    return tables;
  }
  void return_connection(std::unique_ptr<MemoryTables> tables) const {
    const std::lock_guard lock(mutex);
    idle.push_back(std::move(tables));
  }
  /// Connections to a server that could not be reached are useless afterwards.
  void drop_idle_connections() const {
    std::vector<std::unique_ptr<MemoryTables>> dropped;
    const std::lock_guard lock(mutex);
    dropped.swap(idle);
  }

  void count_search(const SearchResult& found, std::chrono::steady_clock::duration duration) const {
    const std::lock_guard lock(mutex);
    ++counters.searches;
    counters.views_read += found.views_in_full;
    counters.seconds += std::chrono::duration<double>(duration).count();
  }

  // ---- refreshing

  bool refresh() {
    const std::lock_guard only_one(refreshing);
    try {
      std::set<MemoryArea> changed_areas;
      bool all = compare_all || !is_postgresql_address(path);
      bool any = all;
      if (is_postgresql_address(path) && !changes) {
        changes.emplace(path);
        all = any = true;
      }
      while (changes) {
        const auto change = changes->wait(std::chrono::milliseconds(0));
        if (!change) break;
        any = true;
        all = all || change->areas.empty();
        changed_areas.insert(change->areas.begin(), change->areas.end());
      }
      if (!any) return false;
      if (!own) own = connect();
      compare_all = true;  // until it is done
      const bool found = update_sketches(changed_areas, all || changed_areas.size() > max_areas);
      compare_all = false;
      return found || is_postgresql_address(path);
    } catch (const FileError&) {
      compare_all = true;
      own.reset();
      changes.reset();
      throw;
    }
  }

  /// Updates the sketches of changed areas, or of all views; true if any were added or removed.
  bool update_sketches(const std::set<MemoryArea>& changed_areas, bool all) {
    const auto reading = own->transaction(MemoryTables::Kind::reading);
    std::vector<ViewId> there;
    std::vector<ViewId> before;
    if (all) {
      static_cast<void>(own->last_id());  // refuses a memory that was removed
      there = own->views();
      before = areas.all();
    } else {
      for (const MemoryArea& area : changed_areas) {
        const double x_m = area.column * memory_area_side_m;
        const double y_m = area.row * memory_area_side_m;
        for (const PosedView& row :
             own->views_within({x_m, x_m + memory_area_side_m, y_m, y_m + memory_area_side_m})) {
          if (to_memory_area(row.pose.x_m, row.pose.y_m) != area) continue;
          there.push_back(row.id);
          if (areas.has(row.id)) areas.set(row.id, area);  // it may have moved
        }
      }
      std::ranges::sort(there);
      before = areas.find_views_in(changed_areas);
    }
    std::vector<ViewId> added;
    for (const ViewId view : there) {
      if (!areas.has(view)) added.push_back(view);
    }
    std::vector<ViewId> removed;
    std::ranges::set_difference(before, there, std::back_inserter(removed));
    if (!all && !removed.empty()) {  // some may only have moved
      std::vector<ViewId> elsewhere;
      own->read_available_views(removed, [&](const ViewRow& row) {
        elsewhere.push_back(row.id);
        const auto& pose = row.info.pose;
        areas.set(row.id,
                  to_memory_area_if_known(pose ? std::optional(pose->position()) : std::nullopt));
      });
      std::ranges::sort(elsewhere);
      std::erase_if(removed,
                    [&](ViewId view) { return std::ranges::binary_search(elsewhere, view); });
    }
    if (added.empty() && removed.empty()) return false;
    Sketcher sketcher(header.shape);
    for (std::size_t begin = 0; begin < added.size();) {
      // One statement reads consecutive ids.
      std::size_t end = begin + 1;
      while (end < added.size() && added[end].value == added[end - 1].value + 1) ++end;
      own->read_magnitudes(added[begin], added[end - 1], header.shape.size(),
                           [&](const MagnitudesRow& row) { sketcher.add(*own, row); });
      begin = end;
    }
    sketcher.flush();
    ViewSketches next = sketched()->sketches;
    next.erase(removed);
    next.insert(sketcher.sketches);
    for (const ViewId view : removed) areas.erase(view);
    sketcher.store_areas(areas);
    publish(std::move(next));
    return true;
  }

  static constexpr std::size_t max_areas = 200;

  std::filesystem::path path;
  MemoryHeader header;
  mutable std::mutex mutex;  // guards `current`, `idle`, `counters`
  std::shared_ptr<const Sketched> current;
  mutable std::vector<std::unique_ptr<MemoryTables>> idle;
  mutable SearchCounters counters;
  mutable std::atomic<int> running = 0;  // number of running searches

  std::mutex refreshing;  // guards all members below
  std::unique_ptr<MemoryTables> own;
  std::optional<MemoryChanges> changes;
  AreasOfViews areas;
  bool compare_all = false;
};

struct PlaceSearch::Snapshot::Implementation {
  explicit Implementation(const PlaceSearch::Implementation& search_)
      : search(&search_), sketched(search_.sketched()) {
    if ((tables = search->borrow_connection())) {
      try {
        reading = tables->transaction(MemoryTables::Kind::reading);
        return;
      } catch (const FileError&) {  // its server was away; it may be back
        tables.reset();
        search->drop_idle_connections();
      }
    }
    tables = search->connect();
    reading = tables->transaction(MemoryTables::Kind::reading);
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;
  ~Implementation() {
    reading.reset();
    if (!failed) search->return_connection(std::move(tables));
  }

  /// Runs `read_some`; if it throws, the connection is not used again.
  template <class Read>
  void mark_failed_on_throw(const Read& read_some) {
    try {
      read_some();
    } catch (...) {
      failed = true;
      throw;
    }
  }

  /// Reads those of the views that are not cached.
  void read_if_needed(std::span<const ViewId> views) {
    std::vector<ViewId> unread;
    std::ranges::copy_if(views, std::back_inserter(unread),
                         [this](ViewId view) { return !cached.contains(view); });
    if (!unread.empty()) read(unread);
  }

  void read(std::span<const ViewId> views) {
    mark_failed_on_throw([&] {
      tables->read_available_views(views, [&](const ViewRow& row) {
        tables->accept_row(row.id, [&] {
          const SignatureShape shape = search->header.shape;
          CachedView view{row.info, {}};
          unpack_signature(tables->check_row(row, shape, scratch).signature, shape, view.signature);
          cached.insert_or_assign(row.id, std::move(view));
        });
      });
    });
  }

  struct CachedView {
    ReferenceInfo info;
    PackedSignature signature;
  };
  const PlaceSearch::Implementation* search;
  std::shared_ptr<const PlaceSearch::Implementation::Sketched> sketched;
  std::unique_ptr<MemoryTables> tables;
  std::unique_ptr<MemoryTables::Transaction> reading;
  bool failed = false;
  RecordBytes scratch;
  std::unordered_map<ViewId, CachedView> cached;
};

PlaceSearch::Snapshot::Snapshot(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
PlaceSearch::Snapshot::~Snapshot() = default;
PlaceSearch::Snapshot::Snapshot(Snapshot&&) noexcept = default;
PlaceSearch::Snapshot& PlaceSearch::Snapshot::operator=(Snapshot&&) noexcept = default;

std::size_t PlaceSearch::Snapshot::size() const noexcept {
  return implementation_->sketched->sketches.size();
}

SearchResult PlaceSearch::Snapshot::search(const PackedSignature& query,
                                           const SearchOptions& options, const SearchMask& mask) {
  Implementation& own = *implementation_;
  const auto start = std::chrono::steady_clock::now();
  // A single search uses all cores; concurrent searches share them.
  struct Running {
    explicit Running(std::atomic<int>& all_) : all(all_), number(++all_) {}
    ~Running() { --all; }
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;
    std::atomic<int>& all;
    int number;
  };
  const Running running(own.search->running);
  const auto cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  Executor executor(size() < 100000 ? 1 : std::clamp(cores / running.number, 1, 16));
  SearchResult result = own.sketched->sketches.search(
      query, options, mask,
      [&own](std::span<const ViewId> views, const ViewSketches::TakeView& take) {
        own.read_if_needed(views);
        for (const ViewId view : views) {
          const auto found = own.cached.find(view);
          if (found != own.cached.end()) take(view, found->second.signature.magnitudes);
        }
      },
      executor);
  own.search->count_search(result, std::chrono::steady_clock::now() - start);
  return result;
}

VisualMemory PlaceSearch::Snapshot::load(std::span<const ViewId> views) {
  Implementation& own = *implementation_;
  const std::set<ViewId> ascending(views.begin(), views.end());
  own.read_if_needed(views);
  const MemoryHeader& header = own.search->header;
  VisualMemory memory(header.shape, header.full_scale, header.elevations);
  for (const ViewId view : ascending) {
    const auto found = own.cached.find(view);
    if (found == own.cached.end()) continue;
    own.tables->accept_row(view, [&] {
      try {
        memory.append_with_id(view, found->second.signature, found->second.info);
      } catch (const ContractError& error) {
        own.tables->fail_damaged(error.what());
      }
    });
  }
  return memory;
}

std::optional<ViewId> PlaceSearch::Snapshot::find(std::string_view name) {
  std::optional<ViewId> found;
  implementation_->mark_failed_on_throw([&] { found = implementation_->tables->find(name); });
  return found;
}

std::vector<ViewId> PlaceSearch::Snapshot::views_within(std::span<const PositionBounds> bounds) {
  Implementation& own = *implementation_;
  std::set<ViewId> views;
  own.mark_failed_on_throw([&] {
    for (const PositionBounds& each : bounds) {
      for (const PosedView& row : own.tables->views_within(each)) views.insert(row.id);
    }
  });
  return {views.begin(), views.end()};
}

std::vector<PosedView> PlaceSearch::Snapshot::posed_views() {
  Implementation& own = *implementation_;
  std::vector<PosedView> views;
  own.mark_failed_on_throw([&] {
    views = own.tables->views_within(
        {-max_position_m, max_position_m, -max_position_m, max_position_m});
  });
  std::erase_if(views, [](const PosedView& view) {  // damaged row, as searches skip it
    return view.pose.heading_rad && !std::isfinite(*view.pose.heading_rad);
  });
  return views;
}

PlaceSearch::PlaceSearch(const std::filesystem::path& memory)
    : implementation_(std::make_unique<Implementation>(memory)) {}
PlaceSearch::~PlaceSearch() = default;
PlaceSearch::PlaceSearch(PlaceSearch&&) noexcept = default;
PlaceSearch& PlaceSearch::operator=(PlaceSearch&&) noexcept = default;

const MemoryHeader& PlaceSearch::header() const noexcept {
  return implementation_->header;
}
std::size_t PlaceSearch::size() const {
  return implementation_->sketched()->sketches.size();
}
std::vector<ViewId> PlaceSearch::views() const {
  return implementation_->sketched()->sketches.views();
}
std::uint64_t PlaceSearch::bytes() const {
  return implementation_->sketched()->bytes;
}

SearchCounters PlaceSearch::counters() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->counters;
}

std::unique_ptr<ViewIndex> PlaceSearch::index() const {
  return std::make_unique<Snapshot>(snapshot());
}

PlaceSearch::Snapshot PlaceSearch::snapshot() const {
  return Snapshot(std::make_unique<Snapshot::Implementation>(*implementation_));
}

SearchResult PlaceSearch::search(const PackedSignature& query, const SearchOptions& options,
                                 const SearchMask& mask) const {
  return snapshot().search(query, options, mask);
}

bool PlaceSearch::refresh() {
  return implementation_->refresh();
}

}  // namespace panonav::fleet
