#include "reports/map_picture.hpp"

#include <algorithm>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav_viewer/report_page.hpp"
#include "runs/shown_map.hpp"

namespace panonav::command {

namespace {

/// The nodes of the largest component with their estimated and true positions.
struct ComponentNodes {
  std::vector<Point2> map;
  std::vector<Point2> truth;     // same size as map; empty if one is unknown
  std::vector<Point2> odometry;  // same size as map; empty if one is unknown
  std::unordered_map<ViewId, std::size_t> index_of_view;
};

ComponentNodes collect_nodes(const Dataset& recording, const Mapper::Result& run) {
  ComponentNodes nodes;
  const std::size_t component = find_largest_component(run.map);
  for (std::size_t i = 0; i < run.map.nodes.size(); ++i) {
    const TopologicalMap::Node& node = run.map.nodes[i];
    if (node.component != component) continue;
    const DatasetEntry& entry = recording.entries[run.observations[i]];
    nodes.index_of_view.emplace(node.view, nodes.map.size());
    nodes.map.push_back(node.pose.position());
    if (entry.pose) nodes.truth.push_back(entry.pose->position());
    if (entry.odometry) nodes.odometry.push_back(entry.odometry->position());
  }
  if (nodes.truth.size() != nodes.map.size()) nodes.truth.clear();
  if (nodes.odometry.size() != nodes.map.size()) nodes.odometry.clear();
  return nodes;
}

std::vector<Point2> apply_alignment(const std::vector<Point2>& points, const Alignment& alignment) {
  std::vector<Point2> result;
  for (const Point2& p : points) result.push_back(alignment.apply(p));
  return result;
}

}  // namespace

void declare_map_files(Arguments& arguments, MapFileArguments& files) {
  arguments.option("--tum FILE", files.tum,
                   "Write the poses of the largest part of the map to this file: as CSV if the "
                   "name ends in .csv, otherwise as TUM text");
  arguments.option("--graphml FILE", files.graph, "Write the map as a GraphML graph to this file");
  arguments.option(
      "--picture FILE", files.picture,
      "Draw the map into this PNG or SVG file, next to the true positions if they are known");
  arguments.declare_outputs({"--tum", "--graphml", "--picture"});
}

std::optional<RecordedMapComparison> compare_with_ground_truth(const Dataset& recording,
                                                               const Mapper::Result& run) {
  const ComponentNodes nodes = collect_nodes(recording, run);
  const auto positions = compare_positions(nodes.map, nodes.truth, !run.wheels);
  if (!positions) return std::nullopt;
  RecordedMapComparison comparison{.positions = *positions, .closures = {}};
  comparison.closures = count_closures(run.map, [&](ViewId view) -> std::optional<Point2> {
    const auto found = nodes.index_of_view.find(view);
    if (found == nodes.index_of_view.end()) return std::nullopt;
    return nodes.truth[found->second];
  });
  if (is_comparable(nodes.odometry, nodes.truth)) {
    comparison.odometry_shape_difference = shape_difference(nodes.odometry, nodes.truth).value;
  }
  return comparison;
}

viewer::MapPlot draw_map(const Dataset& recording, const Mapper::Result& run) {
  Mapper::Result shown = run;
  shown.map = to_shown_lengths(run.map, run.unit);
  const ComponentNodes nodes = collect_nodes(recording, shown);
  viewer::MapPlot plot{.title = "Map", .layers = {}, .unit = to_string(run.unit)};
  std::vector<Point2> map = nodes.map;
  if (is_comparable(nodes.map, nodes.truth)) {
    map = apply_alignment(nodes.map, align(nodes.map, nodes.truth, {.allow_scale = !run.wheels}));
    plot.title = "Map and ground truth";
    plot.unit = to_string(LengthUnit::metres);
    plot.layers.push_back(
        {.label = "ground truth", .colour = viewer::PlotColour::black, .lines = {nodes.truth}});
    if (is_comparable(nodes.odometry, nodes.truth)) {
      plot.layers.push_back(
          {.label = "odometry",
           .colour = viewer::PlotColour::vermilion,
           .lines = {apply_alignment(nodes.odometry, align(nodes.odometry, nodes.truth))}});
    }
  }
  viewer::MapLayer closures{.label = "loop closures", .colour = viewer::PlotColour::green};
  for (const TopologicalMap::Edge& edge : run.map.edges) {
    const auto a = nodes.index_of_view.find(edge.a);
    const auto b = nodes.index_of_view.find(edge.b);
    if (edge.kind != Link::Kind::closure || a == nodes.index_of_view.end() ||
        b == nodes.index_of_view.end()) {
      continue;
    }
    closures.lines.push_back({map[a->second], map[b->second]});
  }
  plot.layers.push_back(
      {.label = "map", .colour = viewer::PlotColour::blue, .lines = {map}, .dots = map});
  if (!closures.lines.empty()) plot.layers.push_back(std::move(closures));
  return plot;
}

void write_map_picture(const std::filesystem::path& path, const Dataset& recording,
                       const Mapper::Result& run) {
  viewer::write_plot(path, draw_map(recording, run));
}

void write_map_report(const std::filesystem::path& folder, const std::string& name,
                      const Dataset& recording, const Mapper::Result& run,
                      const viewer::RunPage& replay_page) {
  viewer::ReportPage page("Map of " + name,
                          "A robot took " + format_count(recording.entries.size(), "image") +
                              " on its path. panonav computed each step of the robot from "
                              "two consecutive images. Where the robot passed a place again, "
                              "panonav used this to correct the map (loop closure).");
  const auto closures =
      std::ranges::count(run.map.edges, Link::Kind::closure, &TopologicalMap::Edge::kind);
  std::vector<std::pair<std::string, std::string>> figures{
      {std::to_string(run.map.nodes.size()), "places"},
      {std::to_string(closures), "loop closures: places that the robot passed again"}};
  const std::size_t components = count_components(run.map);
  if (components > 1) {
    figures.emplace_back(std::to_string(components),
                         "separate parts of the map; the largest part is drawn");
  }
  const auto comparison = compare_with_ground_truth(recording, run);
  if (comparison) {
    figures.emplace_back(format_fixed(comparison->positions.truth_from_map.rms_m, 2) + " m",
                         "root mean square error of the path after the best alignment" +
                             std::string(run.wheels ? "" : " with a free scale"));
    figures.emplace_back(
        format_fixed(comparison->positions.shape.value, 4),
        "Procrustes disparity (difference of the shapes): 0 if the shapes are equal, at most 1");
    if (comparison->odometry_shape_difference) {
      figures.emplace_back(format_fixed(*comparison->odometry_shape_difference, 4),
                           "Procrustes disparity of the odometry alone");
    }
  }
  page.add_figures(figures);
  page.begin_section("The drive, image by image");
  page.add_text(
      "Grey dots are the places of the map, and lines connect them. The large dot is the position "
      "of the current image. Images between two places are not stored in the map.");
  page.add_run(replay_page);
  page.begin_section("The whole map");
  page.add_plots({{draw_map(recording, run),
                   comparison ? "The map, rotated and moved to fit the true path. The true path "
                                "was not used to make the map."
                              : "Places in the order of the images, and loop closures"}});
  page.write(folder, "index.html", "panonav map");
}

}  // namespace panonav::command
