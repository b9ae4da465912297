#include "panonav/relative_pose/reference_views.hpp"

#include <algorithm>

#include "panonav/core/error.hpp"

namespace panonav {

void ReferenceViews::add(const VisualMemory& loaded) {
  if (loaded.empty()) return;
  require(ids_.empty() || ids_.back() < loaded.views().front(), "first view added",
          loaded.views().front().value, "above those held");
  for (const ViewId view : loaded.views()) {
    ids_.push_back(view);
    views_.push_back(homing_view(loaded, view));
  }
}

void ReferenceViews::clear() noexcept {
  ids_.clear();
  views_.clear();
}

const HomingView* ReferenceViews::find(ViewId view) const noexcept {
  const auto at = std::ranges::lower_bound(ids_, view);
  if (at == ids_.end() || *at != view) return nullptr;
  return &views_[static_cast<std::size_t>(at - ids_.begin())];
}

}  // namespace panonav
