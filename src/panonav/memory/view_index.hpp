#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// A rectangle in the frame of the memory's positions.
struct PositionBounds {
  double min_x_m = 0.0,  ///< smallest x, included
      max_x_m = 0.0;     ///< largest x, included
  double min_y_m = 0.0,  ///< smallest y, included
      max_y_m = 0.0;     ///< largest y, included
};

/// A view whose position is known.
struct PosedView {
  ViewId id;           ///< its id in the memory
  ReferencePose pose;  ///< its position, and its heading if known
};

/// Finds the views of a memory, as it is at one moment, by appearance, name or position. The memory
/// is in RAM (`HeldViewIndex`) or stored elsewhere (`IndexedMemory`); an index of a memory
/// elsewhere throws FileError if its views cannot be read. One thread uses an index, for the
/// searches of one query.
class ViewIndex {
 public:
  virtual ~ViewIndex() = default;
  [[nodiscard]] virtual std::size_t size() const = 0;  ///< Views that can be found.
  /// Searches all views as `VisualMemory::search` does.
  [[nodiscard]] virtual SearchResult search(const PackedSignature& query,
                                            const SearchOptions& options,
                                            const SearchMask& mask) = 0;
  /// Returns a memory of those of `views` that exist, without links. `views` may be in any order.
  [[nodiscard]] virtual VisualMemory load(std::span<const ViewId> views) = 0;
  /// Returns the view of that name; nullopt if there is none.
  [[nodiscard]] virtual std::optional<ViewId> find(std::string_view name) = 0;
  /// Returns the views with positions within one of the rectangles, ascending, each once.
  [[nodiscard]] virtual std::vector<ViewId> views_within(
      std::span<const PositionBounds> bounds) = 0;
  /// Returns all views with positions, ascending. Cost: 40 bytes for each. Floors lie apart in one
  /// plane (`make_floor_plane`).
  [[nodiscard]] virtual std::vector<PosedView> posed_views() = 0;
};

/// Searches a memory in RAM, which must outlive the index.
class HeldViewIndex final : public ViewIndex {
 public:
  /// Keeps a reference to the memory; copies nothing.
  explicit HeldViewIndex(const VisualMemory& memory) : memory_(&memory) {}
  [[nodiscard]] std::size_t size() const override { return memory_->size(); }
  [[nodiscard]] SearchResult search(const PackedSignature& query, const SearchOptions& options,
                                    const SearchMask& mask) override;
  /// Copies the signatures.
  [[nodiscard]] VisualMemory load(std::span<const ViewId> views) override;
  [[nodiscard]] std::optional<ViewId> find(std::string_view name) override;
  /// Cost: a pass over all views.
  [[nodiscard]] std::vector<ViewId> views_within(std::span<const PositionBounds> bounds) override;
  [[nodiscard]] std::vector<PosedView> posed_views() override;

 private:
  const VisualMemory* memory_;
};

/// Counters of the exact searches in a memory that is not in RAM.
struct SearchCounters {
  std::uint64_t searches = 0;    ///< number of searches; an image needs one or two
  std::uint64_t views_read = 0;  ///< views that searches read in full
  double seconds = 0.0;          ///< total time of the searches, including the server's part
};

/// A memory that is searched where it is stored: only an index of its views is in RAM, which is
/// smaller than the views. Several threads may use one object.
class IndexedMemory {
 public:
  virtual ~IndexedMemory() = default;
  [[nodiscard]] virtual std::size_t size() const = 0;           ///< Views that can be found.
  [[nodiscard]] virtual std::vector<ViewId> views() const = 0;  ///< Ascending. Cost: a pass.
  [[nodiscard]] virtual std::uint64_t bytes() const = 0;        ///< Size of the index.
  [[nodiscard]] virtual SearchCounters counters() const = 0;    ///< Since the index was made.
  /// Returns a snapshot of the views, which later changes do not affect. *this must outlive the
  /// snapshot. Throws FileError if the memory cannot be reached; a later call may succeed.
  [[nodiscard]] virtual std::unique_ptr<ViewIndex> index() const = 0;
  /// Updates the index with the views that were added or removed since the last call; searches can
  /// continue meanwhile. Returns true if anything changed. Throws FileError; then the index is
  /// unchanged, and the next call compares all views.
  virtual bool refresh() = 0;
};

}  // namespace panonav
