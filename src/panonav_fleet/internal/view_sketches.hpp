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

/// Sketches of views that are stored elsewhere, such as on a server. By them a search selects the
/// few views that can be among the nearest, and reads only these in full (docs/search.md). For the
/// shape 80 x 15 they take 350 bytes a view instead of 2400. A copy shares the sketches and costs
/// little, so that one thread can change a copy while others search the original.
class ViewSketches {
 public:
  /// Receives a view that was read, with its magnitudes, component-major.
  using TakeView = std::function<void(ViewId view, std::span<const std::uint8_t> magnitudes)>;
  /// Reads views in full and passes them to `take`, in any order; removed views are left out.
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
  [[nodiscard]] std::uint64_t bytes() const noexcept;   ///< Size of the sketches.
  [[nodiscard]] std::vector<ViewId> views() const;      ///< Ascending. Cost: a sort.

  /// Adds new views with their magnitudes, one view after the other. Views that are added together
  /// should be of nearby places: searches are faster then. Throws ContractError on another
  /// number of magnitudes. Cost: some microseconds a view.
  void insert(std::span<const ViewId> views, std::span<const std::uint8_t> magnitudes);
  /// Adds all views of `other`, none of which may be present already. Throws ContractError on
  /// another shape.
  void insert(const ViewSketches& other);
  /// Removes those of the views that are present. Cost: a pass over the ids.
  void erase(std::span<const ViewId> views);

  /// Returns the nearest views, exactly those that `VisualMemory::search` finds in a memory of the
  /// views that `read` can read. Calls `read` a few times; a view that it has passed on must not be
  /// removed during the search. `views_in_full` of the result is the number of views that were
  /// read. The result does not depend on the number of threads. Throws ContractError as
  /// `VisualMemory::search`, and what `read` throws.
  [[nodiscard]] SearchResult search(const PackedSignature& query, const SearchOptions& options,
                                    const SearchMask& mask, const ReadViews& read,
                                    Executor& executor) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::fleet
