#include "reports/catchment_report.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav_viewer/plot.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

namespace {

/// Rasterises the values of places; the cell size is the spacing of the places. If places share a
/// cell, it has the value of the last one.
viewer::HeatMap rasterise(const std::vector<Pose2>& places, double spacing_m,
                          const std::function<double(std::size_t)>& value) {
  Point2 low = places.front().position();
  Point2 high = low;
  for (const Pose2& place : places) {
    low = {std::min(low.x_m, place.x_m), std::min(low.y_m, place.y_m)};
    high = {std::max(high.x_m, place.x_m), std::max(high.y_m, place.y_m)};
  }
  // Limits the number of cells, which one distant place could make very large.
  constexpr double max_cells = 500.0;
  const double extent_m = std::max(high.x_m - low.x_m, high.y_m - low.y_m);
  const double cell_m = std::max(spacing_m, extent_m / max_cells);
  const auto cell = [&](double at_m, double from_m) {
    return static_cast<int>(std::lround((at_m - from_m) / cell_m));
  };
  viewer::HeatMap map{.columns = cell(high.x_m, low.x_m) + 1,
                      .rows = cell(high.y_m, low.y_m) + 1,
                      .first_cell = low,
                      .spacing_m = cell_m};
  map.values.assign(static_cast<std::size_t>(map.columns) * static_cast<std::size_t>(map.rows),
                    std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto column = static_cast<std::size_t>(cell(places[i].x_m, low.x_m));
    const auto row = static_cast<std::size_t>(cell(places[i].y_m, low.y_m));
    map.values[row * static_cast<std::size_t>(map.columns) + column] = value(i);
  }
  return map;
}

std::vector<viewer::ReportPlot> draw_curves(const CatchmentResult& result) {
  viewer::Series homeward{.label = "", .style = viewer::SeriesStyle::lines_and_points};
  viewer::Series orientation{.label = "", .style = viewer::SeriesStyle::lines_and_points};
  for (const CatchmentResult::Bin& bin : result.bins) {
    if (bin.homeward.distance_m <= 0.0) continue;
    homeward.add(bin.homeward.distance_m, bin.homeward.component);
    orientation.add(bin.homeward.distance_m, degrees(bin.orientation_error_rad));
  }
  viewer::Series areas{.label = "", .style = viewer::SeriesStyle::lines_and_points};
  const auto places = static_cast<double>(result.survey.places.size());
  for (std::size_t i = 0; i < result.areas.size(); ++i) {
    areas.add(result.accepted_m[i], 100.0 * result.areas[i] / places);
  }
  return {{viewer::LinePlot{.title = "Average homeward component",
                            .x_label = "distance from home [m]",
                            .y_label = "homeward component",
                            .series = {homeward},
                            .y_range = std::pair{-0.2, 1.0}},
           "Homeward component: cosine of the angle between home vector and true direction. 1: "
           "straight home; 0: random direction [S06 figure 10]"},
          {viewer::LinePlot{.title = "Error of the heading",
                            .x_label = "distance from home [m]",
                            .y_label = "circular standard deviation [degrees]",
                            .series = {orientation}},
           "Error of the heading that is computed with the home vector [S06 figure 8]"},
          {viewer::LinePlot{.title = "Mean catchment area",
                            .x_label = "accepted distance from home [m]",
                            .y_label = "share of all places [%]",
                            .series = {areas},
                            .y_range = std::pair{0.0, 100.0}},
           "Share of starts from which a simulated drive ends within this distance of home [S06 "
           "figure 11]"}};
}

viewer::MapPlot draw_field(const RecordedViews& places, const std::vector<HomeVector>& vectors,
                           const CatchmentResult& result, std::size_t goal) {
  const double side_m = 0.5 * result.spacing_m;
  const double arrow_m = 0.8 * result.spacing_m;
  viewer::MapLayer inside{.label = "catchment area", .colour = viewer::PlotColour::green};
  viewer::MapLayer arrows{.label = "home vector", .colour = viewer::PlotColour::blue};
  for (std::size_t p = 0; p < places.views.size(); ++p) {
    const Pose2& place = result.survey.places[p];
    const float end_m = result.final_m[goal * places.views.size() + p];
    if (static_cast<double>(end_m) <= 1.001 * result.spacing_m) {
      inside.filled_polygons.push_back({{place.x_m - side_m, place.y_m - side_m},
                                        {place.x_m + side_m, place.y_m - side_m},
                                        {place.x_m + side_m, place.y_m + side_m},
                                        {place.x_m - side_m, place.y_m + side_m}});
    }
    if (!(vectors[p].length() > 0.0)) {
      arrows.dots.push_back(place.position());
      continue;
    }
    arrows.lines.push_back(make_arrow_line(
        {place.x_m, place.y_m, place.heading_rad + vectors[p].direction_rad()}, arrow_m));
  }
  const viewer::MapLayer home{.label = "home",
                              .colour = viewer::PlotColour::black,
                              .squares = {result.survey.goals[goal].position()}};
  return {.title = "Home vectors from above", .layers = {inside, arrows, home}};
}

std::vector<std::vector<std::string>> format_bins(std::span<const CatchmentResult::Bin> bins) {
  std::vector<std::vector<std::string>> rows;
  for (const CatchmentResult::Bin& bin : bins) {
    rows.push_back({format_fixed(bin.homeward.distance_m, 3), std::to_string(bin.homeward.pairs),
                    format_fixed(bin.homeward.component, 3),
                    format_fixed(degrees(bin.orientation_error_rad), 1)});
  }
  return rows;
}

}  // namespace

void write_catchment_report(const std::filesystem::path& folder, const RecordedViews& goals,
                            const RecordedViews& places, const CatchmentResult& result,
                            const FourierHomingOptions& homing, std::size_t goal) {
  const double accepted_m = result.spacing_m;
  const auto count = static_cast<double>(result.survey.places.size());
  auto sizes = rasterise(result.survey.goals, result.spacing_m, [&](std::size_t g) {
    return 100.0 * static_cast<double>(count_places_in_catchment(result, g, accepted_m)) / count;
  });
  sizes.title = "Catchment area of the view at each place";
  sizes.value_label = "share of all places [%]";

  std::vector<HomeVector> vectors;
  std::vector<double> differences;
  for (const HomingView& view : places.views) {
    vectors.push_back(home_vector(goals.views[goal], view, homing));
    differences.push_back(image_difference(goals.views[goal], view, homing.highest));
  }
  auto difference = rasterise(result.survey.places, result.spacing_m,
                              [&](std::size_t p) { return differences[p]; });
  difference.title = "Difference from the view at home (cross)";
  difference.value_label = "image difference, 0 to 1";
  difference.crosses = {result.survey.goals[goal].position()};
  auto ends = rasterise(result.survey.places, result.spacing_m, [&](std::size_t p) {
    return static_cast<double>(result.final_m[goal * places.views.size() + p]);
  });
  ends.title = "End of each drive home, by its start (home: cross)";
  ends.value_label = "distance from home at the end [m]";
  ends.crosses = difference.crosses;

  viewer::ReportPage page(
      "Distances from which a robot finds home",
      "A home vector is the computed direction from a current view to a home view. This page uses "
      "every view of a recording as a home, and every view of " +
          format_count(places.views.size(), "place") +
          " as the current view. It measures the error of the home vectors, and where a "
          "robot ends that follows them from place to place.");
  page.add_figures(
      {{format_fixed(result.component, 3),
        "average homeward component, " + format_count(result.pairs, "pair")},
       {format_fixed(degrees(result.orientation_error_rad), 1) + " degrees",
        "error of the heading"},
       {format_fixed(result.areas[1], 1) + " of " + std::to_string(result.survey.places.size()),
        "places from which a drive ends within " + format_fixed(result.spacing_m, 2) + " m"}});
  page.begin_section("Results by distance");
  page.add_plots(draw_curves(result));
  page.begin_section("Results by place");
  page.add_plots({{sizes, "Share of all places from which a drive ends within " +
                              format_fixed(result.spacing_m, 2) + " m of home, for each home"}});
  page.begin_section("One home: " + goals.files[goal]);
  page.add_plots({{draw_field(places, vectors, result, goal),
                   "Home vectors and catchment area [S06 figure 9]: the places from which the "
                   "robot reaches home"},
                  {difference, "Difference of each view from the view at home [S06 figure 9]"},
                  {ends, "Distance from home at the end of each drive [S06 figure 14]"}});
  page.begin_section("Numbers");
  page.add_table({"distance [m]", "pairs", "homeward component", "heading error [degrees]"},
                 format_bins(result.bins));
  page.write(folder, "index.html", "panonav catchment");
}

}  // namespace panonav::command
