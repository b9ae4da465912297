#include "panonav/memory/view_index.hpp"

#include <algorithm>

#include "panonav/memory/floors.hpp"

namespace panonav {

SearchResult HeldViewIndex::search(const PackedSignature& query, const SearchOptions& options,
                                   const SearchMask& mask) {
  return memory_->search(query, options, mask);
}

VisualMemory HeldViewIndex::load(std::span<const ViewId> views) {
  std::vector<ViewId> ascending(views.begin(), views.end());
  std::ranges::sort(ascending);
  ascending.erase(std::unique(ascending.begin(), ascending.end()), ascending.end());
  VisualMemory part(memory_->shape(), memory_->full_scale(), memory_->elevations());
  for (const ViewId view : ascending) {
    if (memory_->contains(view))
      part.append_with_id(view, memory_->packed(view), memory_->info(view));
  }
  return part;
}

std::optional<ViewId> HeldViewIndex::find(std::string_view name) {
  return memory_->find(name);
}

std::vector<ViewId> HeldViewIndex::views_within(std::span<const PositionBounds> bounds) {
  std::vector<ViewId> found;
  for (const ViewId view : memory_->views()) {
    const auto& pose = memory_->info(view).pose;
    const auto contains = [&](const PositionBounds& box) {
      return box.min_x_m <= pose->x_m && pose->x_m <= box.max_x_m && box.min_y_m <= pose->y_m &&
             pose->y_m <= box.max_y_m;
    };
    if (pose && std::ranges::any_of(bounds, contains)) found.push_back(view);
  }
  return found;
}

std::vector<PosedView> HeldViewIndex::posed_views() {
  std::vector<PosedView> posed;
  FloorPlane plane;
  for (const ViewId view : memory_->views()) {
    const ReferenceInfo& info = memory_->info(view);
    const auto position = find_position(info);
    if (!position) continue;
    const Point2 in_plane = plane.to_plane(*position);
    posed.push_back({view, {in_plane.x_m, in_plane.y_m, info.pose->heading_rad}});
  }
  return posed;
}

}  // namespace panonav
