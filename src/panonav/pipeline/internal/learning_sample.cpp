#include "panonav/pipeline/internal/learning_sample.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "panonav/localisation/place_model.hpp"

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

/// Functions by which `choose_learning_sample` finds positions.
struct PositionSource {
  std::function<std::optional<Point2>(ViewId)> position;  ///< nullopt: unknown
  std::function<std::vector<ViewId>(const PositionBounds&)> views_within;
};

// Returns the views, ascending, that `load_learning_sample` loads.
std::vector<ViewId> choose_learning_sample(std::span<const ViewId> views,
                                           std::span<const ViewId> sampled, std::size_t max_views,
                                           const PositionSource& source) {
  std::vector<ViewId> sample;
  const auto add = [&](std::span<const ViewId> more) {
    sample.insert(sample.end(), more.begin(), more.end());
  };
  for (const ViewId seed : sampled) {
    if (sample.size() >= max_views) break;
    if (const auto position = source.position(seed)) {
      add(source.views_within(enclosing_area_bounds(*position)));
      std::erase_if(sample, [&](ViewId view) { return view > views.back(); });
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
  return sample;
}

}  // namespace

std::size_t count_learnt_views(std::size_t views) noexcept {
  constexpr std::size_t end_of_exact = 1000;  // of three digits
  std::size_t unit = 1;
  while (views / unit >= end_of_exact) unit *= 10;
  return views / unit * unit;
}

LearntViews::LearntViews(const VisualMemory& memory) : all_(&memory) {
  const auto views = memory.views().first(count_learnt_views(memory.size()));
  HeldViewIndex index(memory);
  if (views.size() > max_learnt_views) {
    part_ = load_learning_sample(index, views, sample_reference_views(views), max_learnt_views);
  } else if (views.size() < memory.size()) {
    part_ = index.load(views);
  }
}

VisualMemory load_learnt_views(const MemoryFile& file,
                               std::span<const MemoryFile::ViewPlace> places) {
  std::vector<ViewId> views;
  for (const auto& place : places.first(count_learnt_views(places.size()))) {
    views.push_back(place.view);
  }
  if (views.size() <= max_learnt_views) return file.load(views);
  const PositionSource source{
      [&](ViewId view) -> std::optional<Point2> {
        const auto place = std::ranges::lower_bound(places, view, {}, &MemoryFile::ViewPlace::view);
        return place->pose ? std::optional(place->pose->position()) : std::nullopt;
      },
      [&](const PositionBounds& bounds) { return file.views_within(bounds); }};
  return file.load(
      choose_learning_sample(views, sample_reference_views(views), max_learnt_views, source));
}

VisualMemory load_learning_sample(ViewIndex& index, std::span<const ViewId> views,
                                  std::span<const ViewId> sampled, std::size_t max_views) {
  const VisualMemory seeds = index.load(sampled);
  const PositionSource source{
      [&](ViewId view) -> std::optional<Point2> {
        if (!seeds.contains(view) || !seeds.info(view).pose) return std::nullopt;
        return seeds.info(view).pose->position();
      },
      [&](const PositionBounds& bounds) { return index.views_within(std::span(&bounds, 1)); }};
  return index.load(choose_learning_sample(views, sampled, max_views, source));
}

}  // namespace panonav
