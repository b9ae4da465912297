#include "panonav/localisation/internal/query_views.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "panonav/localisation/neighbour_support.hpp"
#include "panonav/localisation/reference_layout.hpp"

namespace panonav {

namespace {

/// Replaces overlapping rectangles by one that encloses both, until none overlap.
std::vector<PositionBounds> join_overlapping(std::vector<PositionBounds> boxes) {
  const auto overlap = [](const PositionBounds& a, const PositionBounds& b) {
    return a.min_x_m <= b.max_x_m && b.min_x_m <= a.max_x_m && a.min_y_m <= b.max_y_m &&
           b.min_y_m <= a.max_y_m;
  };
  for (std::size_t i = 0; i < boxes.size();) {
    const auto other =
        std::find_if(boxes.begin() + static_cast<std::ptrdiff_t>(i) + 1, boxes.end(),
                     [&](const PositionBounds& box) { return overlap(boxes[i], box); });
    if (other == boxes.end()) {
      ++i;
      continue;
    }
    boxes[i] = {
        std::min(boxes[i].min_x_m, other->min_x_m), std::max(boxes[i].max_x_m, other->max_x_m),
        std::min(boxes[i].min_y_m, other->min_y_m), std::max(boxes[i].max_y_m, other->max_y_m)};
    boxes.erase(other);
    i = 0;
  }
  return boxes;
}

}  // namespace

PackedSignature mask_rows(PackedSignature signature, std::span<const std::uint8_t> allowed_rows) {
  if (allowed_rows.empty()) return signature;
  for (std::size_t i = 0; i < signature.magnitudes.size(); ++i) {
    if (allowed_rows[i % allowed_rows.size()] == 0) signature.magnitudes[i] = 0;
  }
  return signature;
}

std::optional<LocalFeatures> mask_rows(std::optional<LocalFeatures> features,
                                       std::span<const std::uint8_t> allowed_rows) {
  if (features && !allowed_rows.empty()) {
    std::erase_if(features->features, [&](const LocalFeatures::Feature& feature) {
      return allowed_rows[feature.row] == 0;
    });
  }
  return features;
}

std::vector<PositionBounds> bound_neighbours(const VisualMemory& memory,
                                             std::span<const RankedMatch> ranked, double spacing_m,
                                             double position_spacing_m) {
  std::vector<PositionBounds> boxes;
  const double radius_m =
      std::max(NeighbourSupport::radius_m(spacing_m), ReferenceLayout::reach_m(position_spacing_m));
  if (!(radius_m > 0.0)) return boxes;
  for (const RankedMatch& match :
       ranked.first(std::min(ranked.size(), NeighbourSupport::max_examined))) {
    const auto& pose = memory.info(match.match.view).pose;
    if (!pose) continue;
    boxes.push_back(
        {pose->x_m - radius_m, pose->x_m + radius_m, pose->y_m - radius_m, pose->y_m + radius_m});
  }
  return join_overlapping(std::move(boxes));
}

VisualMemory join_memories(const VisualMemory& part, const VisualMemory& sampled) {
  VisualMemory all(part.shape(), part.full_scale(), part.elevations());
  std::vector<ViewId> views;
  std::ranges::set_union(part.views(), sampled.views(), std::back_inserter(views));
  for (const ViewId view : views) {
    const VisualMemory& from = part.contains(view) ? part : sampled;
    // Meanwhile, another user may have reused the name for another view.
    if (all.find(from.info(view).name)) continue;
    all.append_with_id(view, from.packed(view), from.info(view));
  }
  return all;
}

}  // namespace panonav
