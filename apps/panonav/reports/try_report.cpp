#include "reports/try_report.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_viewer/data_url.hpp"
#include "panonav_viewer/report_page.hpp"

namespace panonav::command {

namespace {

viewer::MapPlot draw_map(const Trial& trial) {
  viewer::MapPlot plot{.title = "Map of the images",
                       .unit = trial.map_summary->unit == LengthUnit::metres ? "m" : "view steps"};
  viewer::MapLayer path{.label = "motion between images", .colour = viewer::PlotColour::light_grey};
  viewer::MapLayer known{.label = "recognised", .colour = viewer::PlotColour::blue};
  viewer::MapLayer unknown{.label = "not recognised", .colour = viewer::PlotColour::vermilion};
  const auto& nodes = trial.map->nodes;
  const auto node_of = [&](ViewId view) {
    return static_cast<std::size_t>(
        std::ranges::lower_bound(nodes, view, {}, &TopologicalMap::Node::view) - nodes.begin());
  };
  for (const TopologicalMap::Edge& edge : trial.map->edges) {
    path.lines.push_back(
        {trial.map_poses[node_of(edge.a)].position(), trial.map_poses[node_of(edge.b)].position()});
  }
  for (std::size_t i = 0; i < std::min(nodes.size(), trial.queries.size()); ++i) {
    viewer::MapLayer& layer = trial.queries[i].place.known ? known : unknown;
    layer.dots.push_back(trial.map_poses[i].position());
  }
  plot.layers = {std::move(path), std::move(known), std::move(unknown)};
  return plot;
}

viewer::LinePlot draw_probabilities(const Trial& trial) {
  viewer::Series known{.label = "recognised", .style = viewer::SeriesStyle::points};
  viewer::Series unknown{.label = "not recognised", .style = viewer::SeriesStyle::points};
  for (std::size_t i = 0; i < trial.queries.size(); ++i) {
    const Place& place = trial.queries[i].place;
    (place.known ? known : unknown).add(static_cast<double>(i + 1), place.known_probability);
  }
  return {.title = "Probability that the place is known from the other images",
          .x_label = "image",
          .y_label = "probability",
          .series = {known, unknown},
          .y_range = std::pair{0.0, 1.0}};
}

void add_images(viewer::ReportPage& page, const Trial& trial) {
  if (!trial.example) return;
  page.begin_section("An image as panonav reads it");
  page.add_text(
      "This is what panonav compares: the scene all around, upright, each direction once. If "
      "writing is mirrored, add --columns-run counter-clockwise to the commands. The middle should "
      "be the direction in which the camera moved; if it is another column, add --forward-column.");
  page.add_pictures({{viewer::make_data_url("image/png", encode_png(trial.example->view())),
                      "A full turn from left to right"}});
}

void add_table(viewer::ReportPage& page, const Trial& trial) {
  constexpr std::size_t max_rows = 500;
  std::vector<std::vector<std::string>> rows;
  for (const Trial::Query& query : trial.queries) {
    if (rows.size() == max_rows) break;
    const auto& matches = query.place.matches;
    rows.push_back({query.name, query.place.known ? "near " + matches.front().name : "not known",
                    format_fixed(query.place.known_probability, 2)});
  }
  page.begin_section("All images");
  page.add_table({"image", "answer from the other images", "probability"}, rows);
}

}  // namespace

void write_try_report(const std::filesystem::path& folder, const Trial& trial,
                      const TrialVerdict& verdict) {
  const std::string_view made_map = trial.is_arranged() ? "arranged them by their similarity, "
                                    : trial.has_map()   ? "made a map from their order, "
                                                        : "";
  viewer::ReportPage page(verdict.headline,
                          "panonav read the images, stored them in a memory, " +
                              std::string(made_map) +
                              "and then searched for each image among the others.");
  if (trial.queries.size() >= 2) {
    const std::size_t steps = trial.queries.size() - 1;
    std::vector<std::pair<std::string, std::string>> figures{
        {std::to_string(trial.count_known()) + " of " + std::to_string(trial.queries.size()),
         "images recognised among the others"}};
    if (!trial.has_positions && trial.is_in_order) {
      figures.push_back(
          {std::to_string(trial.count_connected_steps()) + " of " + std::to_string(steps),
           "steps between consecutive images whose motion is visible"});
    }
    if (trial.has_map()) {
      const std::size_t parts = trial.map_summary->part_sizes.size();
      figures.push_back(
          {std::to_string(parts),
           parts == 1 ? "connected map" : "parts of the map, not connected with each other"});
    }
    page.add_figures(figures);
  }
  page.begin_section("What this means");
  for (const std::string& finding : verdict.findings) page.add_text(finding);
  if (!verdict.commands.empty()) {
    page.begin_section("Next commands");
    page.add_commands(verdict.commands);
  }
  add_images(page, trial);
  if (!trial.queries.empty()) {
    std::vector<viewer::ReportPlot> plots;
    if (trial.has_map()) {
      plots.push_back(
          {draw_map(trial), "Parts that are not connected are drawn beside each other"});
    }
    plots.push_back({draw_probabilities(trial), "Each image was searched among all other images"});
    page.begin_section(trial.has_map() ? "Map and answers" : "Answers");
    page.add_plots(plots);
  }
  if (!trial.queries.empty()) add_table(page, trial);
  page.write(folder, "index.html", "panonav try");
}

}  // namespace panonav::command
