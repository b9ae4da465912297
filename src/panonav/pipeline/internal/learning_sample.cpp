#include "panonav/pipeline/internal/learning_sample.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace panonav {

namespace {

// Side of the square areas that are loaded completely: several reference spacings (chosen).
constexpr double area_side_m = 10.0;
// Number of views loaded before a sampled view without a position, and the same number from that
// view on (chosen).
constexpr std::size_t neighbouring_view_count = 128;

PositionBounds enclosing_area_bounds(Point2 position) {
  const double x_m = std::floor(position.x_m / area_side_m) * area_side_m;
  const double y_m = std::floor(position.y_m / area_side_m) * area_side_m;
  return {x_m, x_m + area_side_m, y_m, y_m + area_side_m};
}

}  // namespace

VisualMemory load_learning_sample(ViewIndex& index, std::span<const ViewId> views,
                                  std::span<const ViewId> sampled, std::size_t max_views) {
  std::vector<ViewId> sample;
  const auto add = [&](std::span<const ViewId> more) {
    sample.insert(sample.end(), more.begin(), more.end());
  };
  const VisualMemory seeds = index.load(sampled);
  for (const ViewId seed : sampled) {
    if (sample.size() >= max_views) break;
    if (!seeds.contains(seed)) continue;
    if (const auto& pose = seeds.info(seed).pose) {
      const PositionBounds area = enclosing_area_bounds(pose->position());
      add(index.views_within(std::span(&area, 1)));
    } else {
      const auto at =
          static_cast<std::size_t>(std::ranges::lower_bound(views, seed) - views.begin());
      const std::size_t first = at - std::min(at, neighbouring_view_count);
      add(views.subspan(first, std::min(2 * neighbouring_view_count, views.size() - first)));
    }
    std::ranges::sort(sample);
    sample.erase(std::unique(sample.begin(), sample.end()), sample.end());
  }
  if (sample.size() > max_views) sample.resize(max_views);
  return index.load(sample);
}

}  // namespace panonav
