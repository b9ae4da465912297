#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav::fleet {

/// Sketches of views that are stored elsewhere, such as on a server: a search selects by them the
/// few views that can be among the nearest, and reads only these in full (docs/search.md). For 80 x
/// 15 they take 350 bytes a view in place of 2400. A copy shares the sketches with the original and
/// costs little, so that one thread changes a copy while others search the original.
class ViewSketches {
 public:
  /// Takes a view that was read and its magnitudes, component-major.
  using TakeView = std::function<void(ViewId view, std::span<const std::uint8_t> magnitudes)>;
  /// Reads views in full, in any order; removed ones are left out.
  using ReadViews = std::function<void(std::span<const ViewId> views, const TakeView& take)>;

  /// Throws ContractError as `VisualMemory`.
  explicit ViewSketches(SignatureShape shape);
  ~ViewSketches();
  /// Shares the sketches.
  ViewSketches(const ViewSketches&);
  ViewSketches& operator=(const ViewSketches&);
  /// A moved-from object may only be destroyed or assigned to.
  ViewSketches(ViewSketches&&) noexcept;
  ViewSketches& operator=(ViewSketches&&) noexcept;

  [[nodiscard]] SignatureShape shape() const noexcept;  ///< Rows and components of every view.
  [[nodiscard]] std::size_t size() const noexcept;      ///< Number of views.
  [[nodiscard]] std::uint64_t bytes() const noexcept;   ///< That the sketches take.
  [[nodiscard]] std::vector<ViewId> views() const;      ///< Ascending. Cost: a sort.

  /// Adds views, none of which may be there already, with their magnitudes one view after the
  /// other. Views that are added together should be of nearby places. Throws ContractError on
  /// another number of magnitudes. Cost: some microseconds a view.
  void insert(std::span<const ViewId> views, std::span<const std::uint8_t> magnitudes);
  /// Adds all views of the other, none of which may be there already. Throws ContractError on
  /// another shape.
  void insert(const ViewSketches& other);
  /// Takes out those of the views that are there. Cost: a pass over the ids.
  void erase(std::span<const ViewId> views);

  /// The nearest views: exactly what `VisualMemory::search` finds in a memory of those of the views
  /// that `read` knows. Calls `read` a few times, in a steady state: what it gave once must not be
  /// removed within one search. `views_in_full` of the result are those read. The same on any
  /// number of threads. Throws ContractError as `VisualMemory::search`, and what `read` throws.
  [[nodiscard]] SearchResult search(const PackedSignature& query, const SearchOptions& options,
                                    const SearchMask& mask, const ReadViews& read,
                                    Executor& executor) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::fleet
