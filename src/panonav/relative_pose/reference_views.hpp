#pragma once

#include <cstddef>
#include <vector>

#include "panonav/memory/visual_memory.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

/// The Fourier coefficients of reference views, made once when the views are loaded and not at each
/// comparison. It holds whole views: compared with a view of fewer components, only the common ones
/// count. Memory: 8 bytes a coefficient, 4 times what the memory itself needs; it is bounded by
/// what the caller loads.
class ReferenceViews {
 public:
  /// Adds all views of a memory. Throws ContractError unless its ids are above those held.
  void add(const VisualMemory& loaded);
  void clear() noexcept;  ///< Forgets all views; ids may then begin anew.

  /// Number of views held.
  [[nodiscard]] std::size_t size() const noexcept { return ids_.size(); }
  /// Null when the view is not held. Valid until the next `add` or `clear`.
  [[nodiscard]] const HomingView* find(ViewId view) const noexcept;

 private:
  std::vector<ViewId> ids_;  // ascending, as `views_`
  std::vector<HomingView> views_;
};

}  // namespace panonav
