#include "demo/pictures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "panonav/signature/dissimilarity.hpp"
#include "reporting/plot.hpp"

namespace panonav::command {

namespace {

MapLayer layer_of(const FloorPlan& plan) {
  return {.label = "furniture", .colour = "#999999", .filled_polygons = plan.boxes};
}

MapLayer references(const VisualMemory& memory) {
  MapLayer layer{.label = "remembered views", .colour = "#0072b2"};
  for (const ViewId view : memory.views()) {
    layer.circles.push_back(memory.info(view).pose->position());
  }
  return layer;
}

}  // namespace

FloorPlan floor_plan(const Renderer& renderer, Point2 low, Point2 high) {
  // Looking down from above the furniture, below the ceiling of any room.
  constexpr double eye_m = 1.9;
  constexpr double counts_from_m = 0.1;  // carpets and sills do not
  constexpr double cell_m = 0.04;
  FloorPlan plan;
  const auto cells = [](double length_m) { return static_cast<int>(std::ceil(length_m / cell_m)); };
  const int columns = cells(high.x_m - low.x_m);
  const int rows = cells(high.y_m - low.y_m);
  for (int j = 0; j < rows; ++j) {
    const double bottom_m = low.y_m + j * cell_m;
    int begin = -1;
    for (int i = 0; i <= columns; ++i) {
      const Vector3 eye{low.x_m + (i + 0.5) * cell_m, bottom_m + 0.5 * cell_m, eye_m};
      const bool filled =
          i < columns && renderer.distance_along(eye, {0.0, 0.0, -1.0}) < eye_m - counts_from_m;
      if (filled && begin < 0) begin = i;
      if (filled || begin < 0) continue;
      const double left_m = low.x_m + begin * cell_m;
      const double right_m = low.x_m + i * cell_m;
      plan.boxes.push_back({{left_m, bottom_m},
                            {right_m, bottom_m},
                            {right_m, bottom_m + cell_m},
                            {left_m, bottom_m + cell_m}});
      begin = -1;
    }
  }
  return plan;
}

void draw_answers(const VisualMemory& memory, const FloorPlan& plan,
                  const std::vector<AskedView>& asked, const std::filesystem::path& path) {
  MapLayer truth{.label = "true place", .colour = "#009e73"};
  MapLayer error{.label = "from there to the answer", .colour = "#d55e00"};
  for (const auto& view : asked) {
    truth.crosses.push_back(view.truth.position());
    if (view.found.position) {
      error.lines.push_back({view.truth.position(), view.found.position->position});
    }
  }
  write_plot(path, MapPlot{.title = "The office from above: x and y in metres",
                           .layers = {layer_of(plan), references(memory), truth, error}});
}

std::vector<double> draw_areas(const VisualMemory& memory, const FloorPlan& plan,
                               const AskedView& asked, const std::filesystem::path& path) {
  // Views within a quarter of the best dissimilarity stay candidates, as in `reproduce m04`: with
  // none the first component alone would drop the true place for noise.
  constexpr double tolerance = 0.25;
  const ReferenceAreas areas(memory);
  const auto levels =
      localise_hierarchically(memory, areas, asked.signature, {.tolerance = tolerance});
  std::vector<MapPlot> panels;
  std::vector<double> areas_m2;
  for (const auto& level : levels) {
    const bool shown = level.components == 1 || level.components == 3 || level.components == 6 ||
                       level.components == memory.shape().components;
    if (!shown) continue;
    MapLayer area{.label = "where the robot may be", .colour = "#e69f00"};
    for (const auto& candidate : level.candidates) {
      area.filled_polygons.push_back(areas.cell(candidate.view));
    }
    const MapLayer robot{
        .label = "the robot", .colour = "#d55e00", .crosses = {asked.truth.position()}};
    areas_m2.push_back(level.area_m2.value_or(std::numeric_limits<double>::quiet_NaN()));
    panels.push_back({.title = std::to_string(level.components) +
                               (level.components == 1 ? " component" : " components"),
                      .layers = {layer_of(plan), area, references(memory), robot}});
  }
  write_plot(path, panels, 2);
  return areas_m2;
}

void draw_similarity(const VisualMemory& memory, double spacing_m, const AskedView& asked,
                     const std::filesystem::path& path) {
  std::vector<double> dissimilarities;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Point2 low{infinity, infinity};
  Point2 high{-infinity, -infinity};
  for (const ViewId view : memory.views()) {
    dissimilarities.push_back(dissimilarity_packed(asked.signature, memory.packed(view)));
    const Point2 at = memory.info(view).pose->position();
    low = {std::min(low.x_m, at.x_m), std::min(low.y_m, at.y_m)};
    high = {std::max(high.x_m, at.x_m), std::max(high.y_m, at.y_m)};
  }
  const auto column_of = [&](double x_m) {
    return static_cast<int>(std::lround((x_m - low.x_m) / spacing_m));
  };
  const auto row_of = [&](double y_m) {
    return static_cast<int>(std::lround((y_m - low.y_m) / spacing_m));
  };
  HeatMap map{.title = "Similarity of every remembered view to the one asked for",
              .value_label = "similarity, 0 to 1000",
              .columns = column_of(high.x_m) + 1,
              .rows = row_of(high.y_m) + 1,
              .first_cell = low,
              .spacing_m = spacing_m,
              .crosses = {asked.truth.position()}};
  map.values.assign(static_cast<std::size_t>(map.columns) * static_cast<std::size_t>(map.rows),
                    std::numeric_limits<double>::quiet_NaN());
  const auto similarity = similarities(dissimilarities);
  std::size_t number = 0;
  for (const ViewId view : memory.views()) {
    const Point2 at = memory.info(view).pose->position();
    const auto cell =
        static_cast<std::size_t>(row_of(at.y_m)) * static_cast<std::size_t>(map.columns) +
        static_cast<std::size_t>(column_of(at.x_m));
    map.values[cell] = similarity[number++];
  }
  write_plot(path, map);
}

}  // namespace panonav::command
