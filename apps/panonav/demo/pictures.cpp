#include "demo/pictures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav::command {

namespace {

viewer::MapLayer draw_references(const VisualMemory& memory, viewer::PlotColour colour) {
  viewer::MapLayer layer{.label = "stored views", .colour = colour};
  for (const ViewId view : memory.views()) {
    layer.circles.push_back(memory.info(view).pose->position());
  }
  return layer;
}

}  // namespace

viewer::MapPlot draw_answers(const VisualMemory& memory, const std::vector<viewer::MapLayer>& scene,
                             const std::vector<LocalisedView>& queries) {
  viewer::MapLayer truth{.label = "true position", .colour = viewer::PlotColour::green};
  viewer::MapLayer error{.label = "error of the answer", .colour = viewer::PlotColour::vermilion};
  for (const auto& view : queries) {
    truth.crosses.push_back(view.truth.position());
    if (view.found.position) {
      error.lines.push_back({view.truth.position(), view.found.position->position()});
    }
  }
  viewer::MapPlot map{.title = "The office from above", .layers = scene};
  for (const viewer::MapLayer& layer :
       {draw_references(memory, viewer::PlotColour::blue), error, truth})
    map.layers.push_back(layer);
  return map;
}

AreaAnimation draw_areas(const VisualMemory& memory, const std::vector<viewer::MapLayer>& scene,
                         const LocalisedView& query) {
  // Views whose dissimilarity is up to 25 % above the best one stay candidates, as in `reproduce
  // m04`. Without this tolerance, noise in the first component would exclude the true place.
  constexpr double tolerance = 0.25;
  const ReferenceAreas areas(memory);
  const auto levels =
      localise_hierarchically(memory, areas, query.signature, {.tolerance = tolerance});
  AreaAnimation animation{.map = {.title = "Possible positions of the robot", .backdrop = scene}};
  animation.map.backdrop.push_back(draw_references(memory, viewer::PlotColour::light_grey));
  for (const auto& level : levels) {
    viewer::MapLayer area{.label = "possible positions", .colour = viewer::PlotColour::orange};
    for (const auto& candidate : level.candidates) {
      area.filled_polygons.push_back(areas.cell(candidate.view));
    }
    const viewer::MapLayer robot{.label = "the robot",
                                 .colour = viewer::PlotColour::vermilion,
                                 .crosses = {query.truth.position()}};
    animation.areas_m2.push_back(level.area_m2.value_or(std::numeric_limits<double>::quiet_NaN()));
    animation.map.frames.push_back({.title = format_count(level.components, "component") + ": " +
                                             format_fixed(animation.areas_m2.back(), 2) + " m²",
                                    .layers = {area, robot}});
  }
  return animation;
}

viewer::HeatMap draw_similarity(const VisualMemory& memory, double spacing_m,
                                const LocalisedView& query) {
  std::vector<double> dissimilarities;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Point2 low{infinity, infinity};
  Point2 high{-infinity, -infinity};
  for (const ViewId view : memory.views()) {
    dissimilarities.push_back(dissimilarity_packed(query.signature, memory.packed(view)));
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
  viewer::HeatMap map{.title = "Similarity of every stored view to the current image",
                      .value_label = "similarity (0 to 1000)",
                      .columns = column_of(high.x_m) + 1,
                      .rows = row_of(high.y_m) + 1,
                      .first_cell = low,
                      .spacing_m = spacing_m,
                      .crosses = {query.truth.position()}};
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
  return map;
}

viewer::ReportPicture embed_image(ImageView image, std::string caption) {
  return {viewer::make_data_url("image/jpeg", encode_jpeg(image)), std::move(caption)};
}

}  // namespace panonav::command
